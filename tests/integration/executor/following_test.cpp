#include <gtest/gtest.h>

#include <cmath>

#include "executor/following_path.hpp"
#include "executor/following_target.hpp"
#include "exemplar/base/rng.hpp"

namespace exemplar::executor {
namespace {

using Eigen::Vector3d;

constexpr double kRate_hz = 60;
constexpr double kNoise_m = 5e-4;

/// To and fro along y, as a cart does.
struct Cart {
  double speed_m_s = 0.2;
  double length_m = 0.4;
  Vector3d At(double t) const {
    const double way = std::fmod(speed_m_s * t, 2 * length_m);
    return {0.5, -0.2 + (way > length_m ? 2 * length_m - way : way), 0.05};
  }
};

TargetTrack Watched(const Cart& cart, double seconds, std::uint64_t seed = 1) {
  TargetTrack track;
  Rng rng(seed);
  for (int i = 0; i <= seconds * kRate_hz; ++i) {
    const double t = i / kRate_hz;
    const Vector3d noise(rng.Normal(0, kNoise_m), rng.Normal(0, kNoise_m), rng.Normal(0, kNoise_m));
    track.Add(FromSeconds(t), cart.At(t) + noise, kNoise_m);
  }
  return track;
}

TEST(TargetTrack, TellsWhereAMovingThingWillBe) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Cart cart{0.1, 0.4};
    const TargetTrack track = Watched(cart, 1.5, seed);
    EXPECT_NEAR(track.speed(), 0.1, 0.01);
    EXPECT_LT((track.PositionAt(FromSeconds(2.5)) - cart.At(2.5)).norm(), 8e-3) << seed;
    EXPECT_EQ(track.turning_points(), 0);
  }
}

TEST(TargetTrack, TakesNoiseForStandingStill) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const TargetTrack track = Watched({0, 0.4}, 3, seed);
    EXPECT_EQ(track.speed(), 0) << seed;
    EXPECT_LT((track.PositionAt(FromSeconds(10)) - Cart().At(0)).norm(), 1e-3);
    EXPECT_FALSE(track.TurnsWithin(FromSeconds(3), FromSeconds(9)));
  }
}

TEST(TargetTrack, LearnsWhereItTurns) {
  const Cart cart{0.2, 0.4};
  const TargetTrack track = Watched(cart, 5.5);  // both ends were seen: at 2 s and 4 s
  EXPECT_EQ(track.turning_points(), 2);
  for (double t = 5.5; t < 8.5; t += 0.1) {
    EXPECT_LT((track.PositionAt(FromSeconds(t)) - cart.At(t)).norm(), 0.02) << t;
  }
  EXPECT_FALSE(track.TurnsWithin(FromSeconds(5.5), FromSeconds(5.8)));
  EXPECT_TRUE(track.TurnsWithin(FromSeconds(5.8), FromSeconds(6.2)));
  EXPECT_LT(track.VelocityAt(FromSeconds(6.5)).y(), 0);
  EXPECT_GT(track.VelocityAt(FromSeconds(8.3)).y(), 0);
}

TEST(TargetTrack, ForgetsItsWayWhenItIsPutElsewhere) {
  TargetTrack track = Watched({0.2, 0.4}, 5);
  const Vector3d place(0.6, 0.3, 0.05);
  for (int i = 1; i <= 60; ++i) track.Add(FromSeconds(5 + i / kRate_hz), place, kNoise_m);
  EXPECT_EQ(track.turning_points(), 0);
  EXPECT_LT((track.PositionAt(FromSeconds(8)) - place).norm(), 2e-3);
}

TEST(TargetTrack, IgnoresWhatIsOlderThanWhatItKnows) {
  TargetTrack track = Watched({0.1, 0.4}, 1);
  const Vector3d before = track.PositionAt(FromSeconds(1));
  track.Add(FromSeconds(0.5), {9, 9, 9}, kNoise_m);
  EXPECT_EQ(track.PositionAt(FromSeconds(1)), before);
}

TEST(TargetTimes, BelongToTheTargetAroundTheTouchOnly) {
  const TargetTimes times{3, 4};
  EXPECT_EQ(times.ShareAt(0.5), 0);
  EXPECT_EQ(times.ShareAt(3), 1);
  EXPECT_EQ(times.ShareAt(4), 1);
  EXPECT_EQ(times.ShareAt(6), 0);
  for (double t = 0; t < 6; t += 0.01) {
    EXPECT_GE(times.ShareAt(t), 0);
    EXPECT_LE(times.ShareAt(t), 1);
    EXPECT_LT(std::abs(times.ShareAt(t + 0.01) - times.ShareAt(t)), 0.03) << t;
  }
}

}  // namespace
}  // namespace exemplar::executor
