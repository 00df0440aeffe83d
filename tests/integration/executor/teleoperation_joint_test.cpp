// One joint that follows: its laws on random motions of an operator.

#include "executor/teleoperation_joint.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "exemplar/base/rng.hpp"

namespace exemplar::executor {
namespace {

constexpr double kPeriod_s = 0.008;

FollowLimits RandomLimits(Rng& rng) {
  return {rng.Uniform(0.5, 4), rng.Uniform(3, 30), rng.Uniform(50, 500)};
}

TEST(TeleoperationJoint, KeepsVelocityAccelerationAndJerkWhateverTheOperatorDoes) {
  Rng rng(1);
  for (int run = 0; run < 200; ++run) {
    const FollowLimits limits = RandomLimits(rng);
    JointMotion now;
    double target = 0;
    double velocity = 0;
    for (int step = 0; step < 300; ++step) {
      if (rng.Uniform(0, 1) < 0.2) target = rng.Uniform(-2, 2);
      if (rng.Uniform(0, 1) < 0.2) velocity = rng.Uniform(-6, 6);
      const double elapsed_s = rng.Uniform(1e-4, 0.02);
      const JointMotion next = Follow(now, target, velocity, limits, elapsed_s);
      ASSERT_LE(std::abs(next.velocity), 1.05 * limits.velocity) << "run " << run;
      ASSERT_LE(std::abs(next.acceleration), limits.acceleration * (1 + 1e-9)) << "run " << run;
      ASSERT_LE(std::abs(next.acceleration - now.acceleration),
                limits.jerk * elapsed_s * (1 + 1e-9))
          << "run " << run;
      now = next;
    }
  }
}

TEST(TeleoperationJoint, ComesToATargetThatStands) {
  Rng rng(2);
  for (int run = 0; run < 200; ++run) {
    const FollowLimits limits = RandomLimits(rng);
    const double target = rng.Uniform(-2, 2);
    JointMotion now{rng.Uniform(-2, 2), 0, 0};
    const double way = std::abs(target - now.position);
    double past = 0;
    const double side = target < now.position ? -1 : 1;
    for (double t = 0; t < 12; t += kPeriod_s) {
      now = Follow(now, target, 0, limits, kPeriod_s);
      past = std::max(past, side * (now.position - target));
    }
    EXPECT_NEAR(now.position, target, 1e-4) << "run " << run;
    EXPECT_NEAR(now.velocity, 0, 1e-3) << "run " << run;
    EXPECT_LE(past, 0.05 * way + 1e-3) << "run " << run;
  }
}

TEST(TeleoperationJoint, FollowsASteadyMotionWithoutFallingBehind) {
  const FollowLimits limits{3, 20, 200};
  JointMotion now;
  double target = 0;
  for (int step = 0; step < 250; ++step) {
    now = Follow(now, target, 1.0, limits, kPeriod_s);
    target += kPeriod_s;
  }
  EXPECT_NEAR(now.position, target, 2e-3);
  EXPECT_NEAR(now.velocity, 1.0, 1e-2);
}

TEST(TeleoperationJoint, SlowsDownWhereTheLimitIsLowered) {
  JointMotion now{0, 2, 0};
  for (int step = 0; step < 100; ++step) {
    now = Follow(now, 10, 0, {0.2, 20, 200}, kPeriod_s);
  }
  EXPECT_LE(now.velocity, 0.21);
}

TEST(Brake, RestsWithinLimitsAndItsTravelIsTheWayMade) {
  Rng rng(3);
  for (int run = 0; run < 2000; ++run) {
    const FollowLimits limits = RandomLimits(rng);
    const JointMotion from{rng.Uniform(-1, 1), rng.Uniform(-1, 1) * limits.velocity,
                           rng.Uniform(-1, 1) * limits.acceleration};
    const Brake brake(from, limits);
    EXPECT_NEAR(brake.At(0).position, from.position, 1e-12);
    EXPECT_NEAR(brake.At(0).velocity, from.velocity, 1e-12);
    const JointMotion end = brake.At(brake.duration_s() - 1e-12);
    ASSERT_NEAR(end.velocity, 0, 1e-6) << "run " << run;
    ASSERT_NEAR(end.acceleration, 0, 1e-6) << "run " << run;
    ASSERT_NEAR(end.position, brake.At(1e3).position, 1e-6) << "run " << run;
    constexpr int kPieces = 400;
    double travel = 0;
    double lowest = from.position;
    double highest = from.position;
    JointMotion before = from;
    for (int i = 1; i <= kPieces; ++i) {
      const JointMotion at = brake.At(brake.duration_s() * i / kPieces);
      const double apart_s = brake.duration_s() / kPieces;
      ASSERT_LE(std::abs(at.acceleration), limits.acceleration * (1 + 1e-9)) << "run " << run;
      ASSERT_LE(std::abs(at.acceleration - before.acceleration),
                limits.jerk * apart_s * (1 + 1e-6) + 1e-9)
          << "run " << run;
      travel += std::abs(at.position - before.position);
      lowest = std::min(lowest, at.position);
      highest = std::max(highest, at.position);
      before = at;
    }
    EXPECT_NEAR(brake.Travel(0, brake.duration_s()), travel, 1e-4) << "run " << run;
    EXPECT_GE(brake.Travel(0, brake.duration_s()), travel - 1e-9) << "run " << run;
    EXPECT_LE(brake.lowest(), lowest + 1e-9) << "run " << run;
    EXPECT_GE(brake.highest(), highest - 1e-9) << "run " << run;
  }
}

}  // namespace
}  // namespace exemplar::executor
