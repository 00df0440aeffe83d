#include "exemplar/demonstration/motion.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "exemplar/base/text.hpp"

namespace exemplar::demonstration {
namespace {

void Append(std::string& row, double value) {
  row += ',';
  row += FormatDouble(value);
}

}  // namespace

std::string ToCsv(const SkillMotion& motion) {
  std::string csv = "time_s";
  for (const std::string& joint : motion.joint_names) csv += "," + joint + "_rad";
  const bool has_tool = !motion.base_T_tool.empty();
  if (has_tool) csv += ",ee_x_m,ee_y_m,ee_z_m";
  if (has_tool && motion.has_orientation) csv += ",ee_qx,ee_qy,ee_qz,ee_qw";
  if (!motion.hand_open.empty()) csv += ",hand_open";
  if (motion.object_names.size() == 1) {
    csv += ",objectivity";
  } else {
    for (const std::string& object : motion.object_names) csv += ",objectivity_" + object;
  }
  if (!motion.sigma_m.empty()) csv += ",sigma_m";
  csv += '\n';
  for (int i = 0; i < motion.frames(); ++i) {
    const auto frame = static_cast<std::size_t>(i);
    csv += FormatDouble(motion.time_s[frame]);
    for (int j = 0; j < motion.joints.cols(); ++j) Append(csv, motion.joints(i, j));
    if (has_tool) {
      const geometry::Pose& pose = motion.base_T_tool[frame];
      for (int k = 0; k < 3; ++k) Append(csv, pose.translation[k]);
      if (motion.has_orientation) {
        for (int k = 0; k < 4; ++k) Append(csv, pose.rotation.coeffs()[k]);
      }
    }
    if (!motion.hand_open.empty()) Append(csv, motion.hand_open[frame]);
    for (int k = 0; k < motion.objectivity.cols(); ++k) Append(csv, motion.objectivity(i, k));
    if (!motion.sigma_m.empty()) Append(csv, motion.sigma_m[frame]);
    csv += '\n';
  }
  return csv;
}

double FrechetDistance(const Eigen::Ref<const Eigen::MatrixXd>& a,
                       const Eigen::Ref<const Eigen::MatrixXd>& b) {
  assert(a.rows() > 0 && b.rows() > 0 && a.cols() == b.cols());
  // Row by row of the coupling table, on squared distances.
  const Eigen::MatrixXd at = a.transpose();
  const Eigen::MatrixXd bt = b.transpose();
  Eigen::VectorXd reach(b.rows());
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    double before = std::numeric_limits<double>::infinity();  // table(i - 1, j - 1)
    for (Eigen::Index j = 0; j < b.rows(); ++j) {
      const double squared = (at.col(i) - bt.col(j)).squaredNorm();
      double least = 0;
      if (i > 0 && j > 0) {
        least = std::min({reach[j], reach[j - 1], before});
      } else if (i > 0) {
        least = reach[j];
      } else if (j > 0) {
        least = reach[j - 1];
      }
      before = reach[j];
      reach[j] = std::max(least, squared);
    }
  }
  return std::sqrt(reach[b.rows() - 1]);
}

}  // namespace exemplar::demonstration
