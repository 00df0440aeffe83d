#include "simulator/follower.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "exemplar/base/rng.hpp"

namespace exemplar::simulator {
namespace {

using std::chrono::milliseconds;

constexpr Duration kStep = milliseconds(1);

std::vector<kinematics::JointLimits> TwoJoints() {
  return {{.lower = -1, .upper = 1, .velocity = 2, .effort = 10, .acceleration = 5},
          {.lower = -2, .upper = 2, .velocity = 2, .effort = 10, .acceleration = 5}};
}

Eigen::VectorXd Pair(double a, double b) { return Eigen::Vector2d(a, b); }

Setpoint At(double a, double b, Duration stamp, std::uint64_t seq = 1) {
  return {Pair(a, b), {}, Stamp::FromNanoseconds(stamp.count()), seq};
}

/// Steps from just after `from` up to `to`.
Follower::Output StepTo(Follower& follower, Duration from, Duration to) {
  Follower::Output out;
  for (Duration t = from + kStep; t <= to; t += kStep) out = follower.At(t);
  return out;
}

TEST(Follower, HoldsWhereItStarts) {
  Follower follower(TwoJoints(), Pair(0.3, -0.2));
  const Follower::Output out = StepTo(follower, Duration(0), milliseconds(100));
  EXPECT_EQ(out.positions, Pair(0.3, -0.2));
  EXPECT_EQ(out.velocities, Pair(0, 0));
  EXPECT_EQ(follower.acted_seq(), 0u);
}

TEST(Follower, ReachesACommandAndNamesIt) {
  Follower follower(TwoJoints(), Pair(0, 0));
  follower.At(Duration(0));
  follower.Command(Duration(0), At(0.1, 0.05, Duration(0), 42), milliseconds(500));
  const Follower::Output out = StepTo(follower, Duration(0), milliseconds(100));
  EXPECT_EQ(out.positions, Pair(0.1, 0.05));
  EXPECT_EQ(follower.acted_seq(), 42u);
  EXPECT_EQ(follower.mode(), Follower::Mode::kFollowing);
}

TEST(Follower, HoldsWhenACommandIsOlderThanItsValidity) {
  Follower follower(TwoJoints(), Pair(0, 0));
  follower.At(Duration(0));
  Setpoint moving = At(0, 0, Duration(0));
  moving.velocities = Pair(1, 0);
  follower.Command(Duration(0), moving, milliseconds(50));
  const double at_end = StepTo(follower, Duration(0), milliseconds(50)).positions[0];
  const Follower::Output later = StepTo(follower, milliseconds(50), milliseconds(500));
  EXPECT_EQ(follower.mode(), Follower::Mode::kHolding);
  EXPECT_EQ(follower.stale_count(), 1);
  EXPECT_NEAR(later.positions[0], at_end, 2e-3);
  EXPECT_EQ(later.velocities, Pair(0, 0));
}

TEST(Follower, FollowsASmoothStreamOfCommandsClosely) {
  Follower follower(TwoJoints(), Pair(0, 0));
  const auto truth = [](double t) { return 0.5 * (1 - std::cos(2 * t)); };
  const Duration period = milliseconds(8);
  double worst = 0;
  for (Duration t{0}; t < std::chrono::seconds(3); t += kStep) {
    if (t % period == Duration(0)) {
      follower.Command(t, At(truth(ToSeconds(t)), 0, t), milliseconds(100));
    }
    const double error = follower.At(t + kStep).positions[0] - truth(ToSeconds(t + kStep));
    if (t > milliseconds(20)) worst = std::max(worst, std::abs(error));
  }
  // Between commands it goes on at their speed: far below a period's way of 8 mrad.
  EXPECT_LT(worst, 3e-4);
}

TEST(Follower, PlaysAStreamSmoothlyThoughItComesUnevenly) {
  Follower follower(TwoJoints(), Pair(0, 0));
  const auto truth = [](double t) { return 0.5 * (1 - std::cos(2 * t)); };
  Rng rng(3);
  const double rate = 60;
  std::vector<std::pair<Duration, Setpoint>> arrivals;
  for (int i = 0; i < 180; ++i) {
    const Duration stamp = FromSeconds(i / rate);
    arrivals.emplace_back(stamp + FromSeconds(rng.Uniform(0.001, 0.006)),
                          At(truth(i / rate), 0, stamp, static_cast<std::uint64_t>(i + 1)));
  }
  std::size_t next = 0;
  double worst_speed_error = 0;
  double worst_lag = 0;
  for (Duration t{0}; t < FromSeconds(2.9); t += kStep) {
    while (next < arrivals.size() && arrivals[next].first <= t) {
      follower.Stream(t, arrivals[next++].second);
    }
    const Follower::Output out = follower.At(t + kStep);
    if (t < milliseconds(300)) continue;
    // Late by the playback delay, the time on the network, half a period: no more.
    const double late = ToSeconds(t) - 0.030;
    worst_speed_error =
        std::max(worst_speed_error, std::abs(out.velocities[0] - std::sin(2 * late)));
    worst_lag = std::max(worst_lag, std::abs(out.positions[0] - truth(late)));
  }
  EXPECT_LT(worst_speed_error, 0.05);
  EXPECT_LT(worst_lag, 0.01);
  EXPECT_EQ(follower.stale_count(), 0);
}

TEST(Follower, StaysWithinLimitsAndSpeeds) {
  Follower follower(TwoJoints(), Pair(0, 0));
  Rng rng(4);
  Eigen::VectorXd before = follower.At(Duration(0)).positions;
  for (int i = 1; i < 5000; ++i) {
    const Duration t = i * kStep;
    if (i % 16 == 0) {
      follower.Command(t, At(rng.Uniform(-4, 4), rng.Uniform(-4, 4), t), milliseconds(200));
    }
    const Follower::Output out = follower.At(t);
    for (Eigen::Index k = 0; k < 2; ++k) {
      EXPECT_LE(std::abs(out.positions[k]), k == 0 ? 1 : 2);
      EXPECT_LE(std::abs(out.positions[k] - before[k]), 2e-3 + 1e-12);
      EXPECT_LE(std::abs(out.velocities[k]), 2);
    }
    before = out.positions;
  }
}

TEST(Follower, GoesHomeGentlyAndArrives) {
  Follower follower(TwoJoints(), Pair(0.8, -1.5));
  follower.At(Duration(0));
  const Duration length = follower.GoTo(Duration(0), Pair(0, 0));
  EXPECT_EQ(follower.mode(), Follower::Mode::kGoingHome);
  double fastest = 0;
  Follower::Output out;
  for (Duration t = kStep; t <= length + kStep; t += kStep) {
    out = follower.At(t);
    fastest = std::max(fastest, out.velocities.cwiseAbs().maxCoeff());
  }
  EXPECT_LT(out.positions.cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(follower.mode(), Follower::Mode::kHolding);
  EXPECT_LE(fastest, 1 + 1e-9) << "half the joints' speed limit";
  EXPECT_GT(fastest, 0.9);
}

TEST(Follower, ASampleEndsTheWayHome) {
  Follower follower(TwoJoints(), Pair(0.5, 0));
  follower.At(Duration(0));
  follower.GoTo(Duration(0), Pair(0, 0));
  StepTo(follower, Duration(0), milliseconds(50));
  follower.Command(milliseconds(50), At(0.5, 0, milliseconds(50)), milliseconds(300));
  EXPECT_EQ(follower.mode(), Follower::Mode::kFollowing);
  EXPECT_NEAR(StepTo(follower, milliseconds(50), milliseconds(150)).positions[0], 0.5, 1e-9);
}

TEST(Follower, StreamSamplesThatRunBackwardsAreIgnored) {
  Follower follower(TwoJoints(), Pair(0, 0));
  follower.At(Duration(0));
  follower.Stream(Duration(0), At(0.1, 0, milliseconds(100)));
  follower.Stream(milliseconds(1), At(0.9, 0, milliseconds(90)));
  EXPECT_NEAR(StepTo(follower, Duration(0), milliseconds(200)).positions[0], 0.1, 1e-12);
}

}  // namespace
}  // namespace exemplar::simulator
