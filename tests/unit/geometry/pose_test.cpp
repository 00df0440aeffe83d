#include "exemplar/geometry/pose.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "exemplar/base/rng.hpp"

namespace exemplar::geometry {
namespace {

Eigen::Quaterniond RandomRotation(Rng& rng) {
  return Eigen::Quaterniond(rng.Normal(), rng.Normal(), rng.Normal(), rng.Normal()).normalized();
}

Pose RandomPose(Rng& rng) {
  return {{rng.Normal(), rng.Normal(), rng.Normal()}, RandomRotation(rng)};
}

void ExpectSamePose(const Pose& a, const Pose& b, double tolerance) {
  EXPECT_LT((a.translation - b.translation).norm(), tolerance);
  EXPECT_LT(AngleBetween(a.rotation, b.rotation), tolerance);
}

TEST(PoseTest, ComposesLikeItsMatrices) {
  Rng rng(1);
  for (int i = 0; i < 100; ++i) {
    const Pose a = RandomPose(rng);
    const Pose b = RandomPose(rng);
    const Eigen::Vector3d p(rng.Normal(), rng.Normal(), rng.Normal());
    EXPECT_LT(((a * b) * p - a.ToIsometry() * (b.ToIsometry() * p)).norm(), 1e-12);
    ExpectSamePose(a * a.Inverse(), Pose::Identity(), 1e-7);
    ExpectSamePose(Pose::FromIsometry(a.ToIsometry()), a, 1e-7);
  }
}

TEST(PoseTest, ExpIsTheInverseOfLog) {
  Rng rng(2);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Quaterniond r = RandomRotation(rng);
    EXPECT_LT(AngleBetween(ExpSo3(LogSo3(r)), r), 1e-7);
    const Eigen::Vector3d tiny = 1e-10 * Eigen::Vector3d(rng.Normal(), rng.Normal(), rng.Normal());
    EXPECT_LT((LogSo3(ExpSo3(tiny)) - tiny).norm(), 1e-20);
  }
  const Eigen::Vector3d half_turn(0, std::numbers::pi, 0);
  EXPECT_NEAR(LogSo3(ExpSo3(half_turn)).norm(), std::numbers::pi, 1e-12);
}

TEST(PoseTest, AngleDoesNotSeeAQuaternionsSign) {
  const Eigen::Quaterniond a = ExpSo3({0.1, 0.2, 0.3});
  const Eigen::Quaterniond minus_a(-a.w(), -a.x(), -a.y(), -a.z());
  EXPECT_NEAR(AngleBetween(a, minus_a), 0, 1e-12);
  EXPECT_NEAR(AngleBetween(a, a * ExpSo3({0, 0, 0.4})), 0.4, 1e-12);
}

TEST(PoseTest, MeanRotationDoesNotSeeSignsAndHonoursWeights) {
  const Eigen::Quaterniond a = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond b = ExpSo3({0, 0, 1.0});
  b.coeffs() = -b.coeffs();
  const std::vector<Eigen::Quaterniond> both{a, b};
  EXPECT_NEAR(AngleBetween(MeanRotation(both), ExpSo3({0, 0, 0.5})), 0, 1e-9);
  const std::vector<double> only_second{0.0, 1.0};
  EXPECT_NEAR(AngleBetween(MeanRotation(both, only_second), b), 0, 1e-9);
}

TEST(PoseTest, SignsBecomeContinuous) {
  std::vector<Pose> poses(5);
  for (int i = 0; i < 5; ++i) {
    poses[static_cast<std::size_t>(i)].rotation = ExpSo3({0, 0, 0.1 * i});
    if (i % 2 == 1) poses[static_cast<std::size_t>(i)].rotation.coeffs() *= -1;
  }
  EXPECT_EQ(MakeSignsContinuous(poses), 2);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    EXPECT_GT(poses[i].rotation.dot(poses[i - 1].rotation), 0);
  }
}

}  // namespace
}  // namespace exemplar::geometry
