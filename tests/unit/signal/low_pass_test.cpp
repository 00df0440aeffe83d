#include "exemplar/signal/low_pass.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "exemplar/base/rng.hpp"

namespace exemplar::signal {
namespace {

constexpr double kRate_hz = 60;

Eigen::VectorXd Sine(double frequency_hz, int n) {
  Eigen::VectorXd x(n);
  for (int k = 0; k < n; ++k) x[k] = std::sin(2 * std::numbers::pi * frequency_hz * k / kRate_hz);
  return x;
}

// Two reaches and a rest, by minimum jerk.
Eigen::VectorXd Reaches(int n) {
  const auto reach = [](double t, double from, double duration) {
    const double s = std::clamp((t - from) / duration, 0.0, 1.0);
    return s * s * s * (10 - 15 * s + 6 * s * s);
  };
  Eigen::VectorXd x(n);
  for (int k = 0; k < n; ++k) {
    const double t = k / kRate_hz;
    x[k] = 0.4 * reach(t, 0.5, 1.2) - 0.25 * reach(t, 2.5, 0.8);
  }
  return x;
}

TEST(LowPass, PassesConstantsAndSlopesUnchanged) {
  Eigen::MatrixXd x(100, 2);
  for (int k = 0; k < 100; ++k) x.row(k) << 5, 0.3 * k - 7;
  for (const double cutoff_hz : {0.5, 2.0, 6.0, 24.0}) {
    EXPECT_LT((LowPass(x, kRate_hz, cutoff_hz) - x).cwiseAbs().maxCoeff(), 1e-9) << cutoff_hz;
  }
}

TEST(LowPass, HalvesThePowerAtTheCutOffWithoutDelay) {
  for (const double cutoff_hz : {1.0, 3.0, 6.0, 12.0, 20.0}) {
    const Eigen::VectorXd x = Sine(cutoff_hz, 3000);
    const Eigen::VectorXd y = LowPass(x, kRate_hz, cutoff_hz);
    const Eigen::VectorXd in = x.segment(600, 1800);
    const Eigen::VectorXd out = y.segment(600, 1800);
    EXPECT_NEAR(out.norm() / in.norm(), std::sqrt(0.5), 1e-3) << cutoff_hz;
    // In phase: nothing but the scale changes.
    EXPECT_NEAR(in.dot(out) / (in.norm() * out.norm()), 1, 1e-6) << cutoff_hz;
  }
}

TEST(LowPass, StopsWhatIsFarAboveTheCutOff) {
  const Eigen::VectorXd y = LowPass(Sine(20, 2000), kRate_hz, 2);
  EXPECT_LT(y.segment(500, 1000).norm() / Sine(20, 2000).segment(500, 1000).norm(), 1e-3);
}

TEST(LowPass, IsLinearAndTreatsChannelsApart) {
  Rng rng(5);
  Eigen::MatrixXd x(80, 2);
  for (Eigen::Index k = 0; k < x.size(); ++k) x.data()[k] = rng.Normal();
  const Eigen::MatrixXd both = LowPass(x, kRate_hz, 4);
  EXPECT_LT((LowPass(x.col(0), kRate_hz, 4) - both.col(0)).norm(), 1e-12);
  const Eigen::VectorXd sum = x.col(0) + 2 * x.col(1);
  EXPECT_LT((LowPass(sum, kRate_hz, 4) - both.col(0) - 2 * both.col(1)).norm(), 1e-12);
}

TEST(LowPass, LeavesTwoSamplesAlone) {
  const Eigen::Vector2d two(1, 4);
  EXPECT_EQ(LowPass(two, kRate_hz, 4), two);
}

TEST(ChooseCutoff, AsksForNoFilterOnCleanMotion) {
  EXPECT_EQ(ChooseCutoff(Reaches(240), kRate_hz).cutoff_hz, 0);
  EXPECT_EQ(ChooseCutoff(Eigen::VectorXd::Constant(100, 3), kRate_hz).cutoff_hz, 0);
  EXPECT_EQ(ChooseCutoff(Eigen::Vector3d(0, 1, 0), kRate_hz).cutoff_hz, 0);
}

TEST(ChooseCutoff, EstimatesTheNoiseAndComesNearTheBestCutOff) {
  for (const double noise : {0.0005, 0.002, 0.008}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      Rng rng(seed);
      const Eigen::VectorXd truth = Reaches(240);
      Eigen::VectorXd seen = truth;
      for (double& x : seen) x += rng.Normal(0, noise);
      const CutoffChoice choice = ChooseCutoff(seen, kRate_hz);
      EXPECT_NEAR(choice.noise, noise, 0.25 * noise);
      ASSERT_GT(choice.cutoff_hz, 0);
      const auto error = [&](double cutoff_hz) {
        return (LowPass(seen, kRate_hz, cutoff_hz) - truth).norm();
      };
      double best = error(1);
      for (double cutoff_hz = 1; cutoff_hz < 24; cutoff_hz *= 1.1) {
        best = std::min(best, error(cutoff_hz));
      }
      EXPECT_LT(error(choice.cutoff_hz), 1.8 * best) << "noise " << noise << " seed " << seed;
    }
  }
}

}  // namespace
}  // namespace exemplar::signal
