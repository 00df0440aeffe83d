#include "timing.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "banded.hpp"
#include "exemplar/base/rng.hpp"
#include "press.hpp"
#include "spline.hpp"
#include "trajectory.hpp"

namespace exemplar::motion {
namespace {

std::vector<kinematics::JointLimits> RandomLimits(int joints, Rng& rng) {
  std::vector<kinematics::JointLimits> limits(static_cast<std::size_t>(joints));
  for (kinematics::JointLimits& limit : limits) {
    limit.lower = -3;
    limit.upper = 3;
    limit.velocity = rng.Uniform(0.3, 4);
    limit.acceleration = rng.Uniform(1, 20);
    limit.jerk = rng.Uniform(20, 500);
  }
  return limits;
}

/// A few waves of random heights and speeds.
Eigen::MatrixXd RandomPath(const std::vector<double>& time_s, int joints, Rng& rng) {
  Eigen::MatrixXd path = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(time_s.size()), joints);
  for (int j = 0; j < joints; ++j) {
    for (int wave = 0; wave < 3; ++wave) {
      const double height = rng.Normal(0, 0.4);
      const double speed = rng.Uniform(0.2, 6);
      const double phase = rng.Uniform(0, 6.28);
      for (std::size_t k = 0; k < time_s.size(); ++k) {
        path(static_cast<Eigen::Index>(k), j) += height * std::sin(speed * time_s[k] + phase);
      }
    }
  }
  return path;
}

std::vector<std::string> Names(int joints) {
  std::vector<std::string> names;
  for (int j = 0; j < joints; ++j) names.push_back("j" + std::to_string(j));
  return names;
}

/// Short motions of all kinds: waves, noise, corners, still joints, two frames.
TEST(Timing, BreaksNoLimitOnVeryManyShortMotions) {
  const char* all = std::getenv("EXEMPLAR_TIMING_MOTIONS");
  const long motions = all != nullptr ? std::strtol(all, nullptr, 10) : 20'000;
  ASSERT_GT(motions, 0);
  Rng rng(11);
  LimitUse largest;
  double largest_jump = 0;
  for (long i = 0; i < motions; ++i) {
    const int joints = 1 + static_cast<int>(rng.Below(7));
    const std::vector<kinematics::JointLimits> limits = RandomLimits(joints, rng);
    const int frames = 2 + static_cast<int>(rng.Below(30));
    std::vector<double> time_s = {0};
    while (static_cast<int>(time_s.size()) < frames) {
      time_s.push_back(time_s.back() + rng.Uniform(0.01, 0.04));
    }
    Eigen::MatrixXd path = RandomPath(time_s, joints, rng);
    const auto kind = rng.Below(4);
    for (int k = 0; k < frames; ++k) {
      for (int j = 0; j < joints; ++j) {
        if (kind == 1) path(k, j) += rng.Normal(0, 0.02);
        if (kind == 2 && k > frames / 2) path(k, j) = path(frames / 2, j);
      }
    }
    if (kind == 3) path.col(0).setConstant(rng.Normal());
    std::vector<double> frame_time_s;
    const JointTrajectory timed =
        TimePath(time_s, path, Names(joints), limits, rng.Uniform(0.05, 1), frame_time_s);
    const LimitUse use = MeasureLimitUse(timed, limits);
    largest = {std::max(largest.velocity, use.velocity),
               std::max(largest.acceleration, use.acceleration), std::max(largest.jerk, use.jerk)};
    largest_jump = std::max(largest_jump, LargestAccelerationJump(timed));
    ASSERT_LE(std::max({use.velocity, use.acceleration, use.jerk}), 1) << i;
    ASSERT_LT(LargestAccelerationJump(timed), 1e-6) << i;
  }
  EXPECT_GT(largest.velocity, 0.9);
  EXPECT_GT(largest.acceleration, 0.9);
  EXPECT_GT(largest.jerk, 0.9);
  RecordProperty("largest_velocity_use", std::to_string(largest.velocity));
  RecordProperty("largest_acceleration_use", std::to_string(largest.acceleration));
  RecordProperty("largest_jerk_use", std::to_string(largest.jerk));
  RecordProperty("largest_acceleration_jump", std::to_string(largest_jump));
}

TEST(Timing, BreaksNoLimitOnRandomMotions) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const int joints = 1 + static_cast<int>(rng.Below(9));
    const std::vector<kinematics::JointLimits> limits = RandomLimits(joints, rng);
    std::vector<double> time_s;
    const int frames = 2 + static_cast<int>(rng.Below(150));
    for (int k = 0; k < frames; ++k) time_s.push_back(k * rng.Uniform(0.015, 0.0151));
    const Eigen::MatrixXd path = RandomPath(time_s, joints, rng);
    std::vector<double> frame_time_s;
    const double scale = rng.Uniform(0.2, 1);
    const JointTrajectory timed =
        TimePath(time_s, path, Names(joints), limits, scale, frame_time_s);
    const LimitUse use = MeasureLimitUse(timed, limits);
    EXPECT_LE(use.velocity, 1 + 1e-9) << i;
    EXPECT_LE(use.acceleration, 1 + 1e-9) << i;
    EXPECT_LE(use.jerk, 1 + 1e-9) << i;
    EXPECT_LT(LargestAccelerationJump(timed), 1e-7) << i;
    EXPECT_EQ(timed.velocities.row(0).norm(), 0) << i;
    EXPECT_EQ(timed.velocities.bottomRows(1).norm(), 0) << i;
    EXPECT_GE(timed.duration_s(), time_s.back() / scale * 0.999) << i;
    for (std::size_t k = 1; k < timed.time_s.size(); ++k) {
      ASSERT_GT(timed.time_s[k], timed.time_s[k - 1]) << i;
    }
    // Every frame of the path is met at the time given for it.
    Eigen::VectorXd position(joints);
    Eigen::VectorXd velocity(joints);
    for (int k = 0; k < frames; ++k) {
      Evaluate(timed, frame_time_s[k], position, velocity);
      EXPECT_LT((position - path.row(k).transpose()).cwiseAbs().maxCoeff(), 2e-3) << i << " " << k;
    }
  }
}

TEST(Timing, UsesTheLimitsWhereTheDemonstrationWasTooFast) {
  Rng rng(2);
  std::vector<double> time_s;
  for (int k = 0; k < 100; ++k) time_s.push_back(0.002 * k);
  Eigen::MatrixXd path(100, 1);
  for (int k = 0; k < 100; ++k) path(k, 0) = 2 * test::MinimumJerk(k / 99.0);
  std::vector<kinematics::JointLimits> limits(1);
  limits[0].velocity = 1;
  limits[0].acceleration = 4;
  std::vector<double> frame_time_s;
  const JointTrajectory timed = TimePath(time_s, path, Names(1), limits, 1, frame_time_s);
  // From rest to rest over 2 rad at 1 rad/s and 4 rad/s^2 nothing is faster than 2.25 s.
  EXPECT_GE(timed.duration_s(), 2.25);
  EXPECT_LT(timed.duration_s(), 1.25 * 2.25);
}

TEST(Timing, StretchesOnlyWhereItMust) {
  // Slow, then one quick move, then slow: the slow parts keep their time.
  std::vector<double> time_s;
  Eigen::MatrixXd path(301, 1);
  for (int k = 0; k <= 300; ++k) {
    const double t = 0.01 * k;
    time_s.push_back(t);
    path(k, 0) = 0.2 * t + 1.0 * test::MinimumJerk((t - 1.4) / 0.2);
  }
  std::vector<kinematics::JointLimits> limits(1);
  limits[0].velocity = 2;
  limits[0].acceleration = 10;
  std::vector<double> frame_time_s;
  const JointTrajectory timed = TimePath(time_s, path, Names(1), limits, 1, frame_time_s);
  EXPECT_NEAR(frame_time_s[100] - frame_time_s[50], 0.5, 0.02);
  EXPECT_NEAR(frame_time_s[250] - frame_time_s[200], 0.5, 0.02);
  EXPECT_GT(frame_time_s[165] - frame_time_s[135], 0.4);
}

TEST(Timing, LinesKeepTheirShareOfTheLimits) {
  Rng rng(3);
  for (int i = 0; i < 200; ++i) {
    const int joints = 1 + static_cast<int>(rng.Below(9));
    const std::vector<kinematics::JointLimits> limits = RandomLimits(joints, rng);
    const Eigen::VectorXd from =
        2 * Eigen::VectorXd::NullaryExpr(joints, [&] { return rng.Normal(); });
    const Eigen::VectorXd to =
        2 * Eigen::VectorXd::NullaryExpr(joints, [&] { return rng.Normal(); });
    const JointTrajectory line = TimeLine(from, to, Names(joints), limits, 0.5);
    const LimitUse use = MeasureLimitUse(line, limits);
    EXPECT_LE(use.velocity, 0.5 + 1e-9);
    EXPECT_LE(use.acceleration, 1 + 1e-9);
    EXPECT_LE(use.jerk, 1 + 1e-9);
    EXPECT_LT(LargestAccelerationJump(line), 1e-7);
    EXPECT_EQ(line.positions.row(0).transpose(), from);
    EXPECT_EQ(line.positions.bottomRows(1).transpose(), to);
  }
}

TEST(Timing, ConcatenatesAtRest) {
  Rng rng(4);
  const std::vector<kinematics::JointLimits> limits = RandomLimits(2, rng);
  const Eigen::Vector2d a(0, 0);
  const Eigen::Vector2d b(1, -1);
  const Eigen::Vector2d c(0.5, 2);
  const JointTrajectory first = TimeLine(a, b, Names(2), limits, 1);
  const JointTrajectory second = TimeLine(b, c, Names(2), limits, 1);
  const JointTrajectory both = Concatenate(first, second);
  EXPECT_DOUBLE_EQ(both.duration_s(), first.duration_s() + second.duration_s());
  Eigen::VectorXd position(2);
  Eigen::VectorXd velocity(2);
  Evaluate(both, first.duration_s(), position, velocity);
  EXPECT_LT((position - b).norm(), 1e-12);
  Evaluate(both, 1e9, position, velocity);
  EXPECT_EQ(position, c);
  EXPECT_EQ(velocity.norm(), 0);
  EXPECT_EQ(Concatenate({}, second).duration_s(), second.duration_s());
}

TEST(Evaluate, HasTheVelocityOfItsPosition) {
  Rng rng(5);
  const std::vector<kinematics::JointLimits> limits = RandomLimits(3, rng);
  const JointTrajectory line =
      TimeLine(Eigen::Vector3d(0, 1, 2), Eigen::Vector3d(1, -1, 0), Names(3), limits, 1);
  Eigen::VectorXd before(3);
  Eigen::VectorXd after(3);
  Eigen::VectorXd velocity(3);
  Eigen::VectorXd unused(3);
  for (int i = 0; i < 200; ++i) {
    const double t = rng.Uniform(0.01, line.duration_s() - 0.01);
    Evaluate(line, t - 1e-6, before, unused);
    Evaluate(line, t + 1e-6, after, unused);
    Evaluate(line, t, before, velocity);
    Evaluate(line, t - 1e-6, before, unused);
    EXPECT_LT(((after - before) / 2e-6 - velocity).norm(), 1e-4);
  }
}

TEST(TrajectoryPath, TravelIsNeverLessThanTheWayMade) {
  const kinematics::RobotDescription robot = test::LoadRobot("arm7");
  Rng rng(6);
  JointTrajectory wave;
  wave.joint_names = robot.chain.joint_names();
  for (int k = 0; k < 60; ++k) wave.time_s.push_back(0.05 * k + rng.Uniform(0, 0.02));
  wave.positions = RandomPath(wave.time_s, robot.chain.dof(), rng);
  wave.velocities =
      Eigen::MatrixXd::NullaryExpr(60, robot.chain.dof(), [&] { return rng.Normal(); });
  const TrajectoryPath path(wave, robot.model, robot.chain);
  const auto joints = static_cast<Eigen::Index>(robot.model.joints.size());
  Eigen::VectorXd last(joints);
  Eigen::VectorXd q(joints);
  for (int i = 0; i < 100; ++i) {
    const double begin = rng.Uniform(0, wave.duration_s());
    const double end = rng.Uniform(begin, wave.duration_s());
    Eigen::VectorXd way = Eigen::VectorXd::Zero(joints);
    path.Position(begin, last);
    for (int step = 1; step <= 300; ++step) {
      path.Position(begin + (end - begin) * step / 300, q);
      way += (q - last).cwiseAbs();
      last = q;
    }
    Eigen::VectorXd travel = Eigen::VectorXd::Zero(joints);
    path.Travel(begin, end, travel);
    EXPECT_TRUE((travel.array() >= way.array() - 1e-9).all()) << i;
  }
}

TEST(BandedMatrix, SolvesLikeADenseSolver) {
  Rng rng(7);
  for (const int band : {0, 1, 4, 11, 27, 40}) {
    const int size = 41;
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
    BandedMatrix banded(size, band);
    for (int j = 0; j < size; ++j) {
      for (int i = j; i < std::min(size, j + band + 1); ++i) {
        const double value = i == j ? 60.0 : rng.Normal();
        dense(i, j) = value;
        dense(j, i) = value;
        banded(i, j) = value;
      }
    }
    const Eigen::VectorXd right = Eigen::VectorXd::NullaryExpr(size, [&] { return rng.Normal(); });
    Eigen::VectorXd solution = right;
    ASSERT_TRUE(banded.Factorise());
    banded.Solve(solution);
    EXPECT_LT((dense * solution - right).norm(), 1e-12) << band;
  }
}

TEST(BandedMatrix, SaysWhenItIsNotPositiveDefinite) {
  BandedMatrix matrix(3, 1);
  for (int i = 0; i < 3; ++i) matrix(i, i) = 1;
  matrix(1, 0) = 2;
  EXPECT_FALSE(matrix.Factorise());
}

TEST(PathSpline, PassesItsKnotsWithContinuousDerivatives) {
  Rng rng(8);
  std::vector<double> time_s = {0};
  for (int k = 1; k < 20; ++k) time_s.push_back(time_s.back() + rng.Uniform(0.05, 0.2));
  const Eigen::MatrixXd values = RandomPath(time_s, 2, rng);
  const PathSpline spline(time_s, values);
  for (std::size_t k = 0; k < time_s.size(); ++k) {
    const PathSpline::Point at = spline.At(time_s[k]);
    EXPECT_LT((at.value - values.row(static_cast<Eigen::Index>(k)).transpose()).norm(), 1e-12);
    if (k == 0 || k + 1 == time_s.size()) {
      EXPECT_LT(at.second.norm(), 1e-9);
      continue;
    }
    const PathSpline::Point before = spline.At(time_s[k] - 1e-9);
    EXPECT_LT((at.first - before.first).norm(), 1e-5);
    EXPECT_LT((at.second - before.second).norm(), 1e-4);
  }
}

}  // namespace
}  // namespace exemplar::motion
