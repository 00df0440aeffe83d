#include "exemplar/demonstration/motion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "exemplar/base/rng.hpp"

namespace exemplar::demonstration {
namespace {

Eigen::MatrixXd RandomPath(int n, Rng& rng) {
  Eigen::MatrixXd path(n, 3);
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < 3; ++k) path(i, k) = rng.Uniform(-1, 1);
  }
  return path;
}

// The definition, without any table.
double Reference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, Eigen::Index i,
                 Eigen::Index j) {
  const double d = (a.row(i) - b.row(j)).norm();
  if (i == 0 && j == 0) return d;
  double least = INFINITY;
  if (i > 0) least = std::min(least, Reference(a, b, i - 1, j));
  if (j > 0) least = std::min(least, Reference(a, b, i, j - 1));
  if (i > 0 && j > 0) least = std::min(least, Reference(a, b, i - 1, j - 1));
  return std::max(d, least);
}

TEST(FrechetDistance, EqualsItsDefinition) {
  Rng rng(1);
  for (int round = 0; round < 200; ++round) {
    const Eigen::MatrixXd a = RandomPath(1 + static_cast<int>(rng.Below(6)), rng);
    const Eigen::MatrixXd b = RandomPath(1 + static_cast<int>(rng.Below(6)), rng);
    EXPECT_NEAR(FrechetDistance(a, b), Reference(a, b, a.rows() - 1, b.rows() - 1), 1e-12);
    EXPECT_NEAR(FrechetDistance(a, b), FrechetDistance(b, a), 1e-12);
    EXPECT_EQ(FrechetDistance(a, a), 0);
  }
}

TEST(ToCsv, WritesTheContractsColumns) {
  SkillMotion motion;
  motion.time_s = {0, 0.5};
  motion.joint_names = {"elbow"};
  motion.joints = Eigen::MatrixXd::Constant(2, 1, 0.25);
  motion.base_T_tool = {geometry::Pose::FromTranslation({1, 2, 3}),
                        geometry::Pose::FromTranslation({4, 5, 6})};
  motion.hand_open = {1, 0};
  motion.object_names = {"button"};
  motion.objectivity = Eigen::MatrixXd::Constant(2, 1, 0.5);
  motion.sigma_m = {0.01, 0.02};
  EXPECT_EQ(ToCsv(motion),
            "time_s,elbow_rad,ee_x_m,ee_y_m,ee_z_m,ee_qx,ee_qy,ee_qz,ee_qw,hand_open,objectivity,"
            "sigma_m\n"
            "0,0.25,1,2,3,0,0,0,1,1,0.5,0.01\n"
            "0.5,0.25,4,5,6,0,0,0,1,0,0.5,0.02\n");
  motion.object_names = {"start", "target"};
  motion.objectivity = Eigen::MatrixXd::Constant(2, 2, 0.5);
  motion.has_orientation = false;
  const std::string csv = ToCsv(motion);
  EXPECT_EQ(csv.substr(0, csv.find('\n')),
            "time_s,elbow_rad,ee_x_m,ee_y_m,ee_z_m,hand_open,objectivity_start,objectivity_target,"
            "sigma_m");
}

}  // namespace
}  // namespace exemplar::demonstration
