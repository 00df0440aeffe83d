#include "elastic.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "exemplar/base/rng.hpp"
#include "exemplar/learning/hermite.hpp"
#include "motions.hpp"

namespace exemplar::learning {
namespace {

constexpr int kSamples = 400;

/// A made curve in the plane at a part of its time.
Eigen::Vector2d Curve(double t) {
  return {0.4 * t + 0.1 * std::sin(3 * std::numbers::pi * t),
          0.2 * std::sin(5 * std::numbers::pi * t) * (1 - 0.4 * t)};
}

template <class Point>
Eigen::MatrixXd Sample(Point&& point) {
  Eigen::MatrixXd samples(kSamples + 1, 2);
  for (int k = 0; k <= kSamples; ++k) {
    samples.row(k) = point(static_cast<double>(k) / kSamples).transpose();
  }
  return samples;
}

/// Slower at first, quicker later; 0 at 0, 1 at 1.
double Late(double t) { return t - 0.12 * std::sin(std::numbers::pi * t); }
double Uneven(double t) { return t + 0.05 * std::sin(2 * std::numbers::pi * t); }

/// The other's time at a time of the one, by their common mean.
double OtherTime(const std::vector<double>& one, const std::vector<double>& other, double t) {
  return MonotoneHermite(one, other)(t);
}

void ExpectIncreasing(const std::vector<double>& warp) {
  EXPECT_EQ(warp.front(), 0);
  EXPECT_EQ(warp.back(), 1);
  for (std::size_t k = 1; k < warp.size(); ++k) ASSERT_GT(warp[k], warp[k - 1]) << k;
}

TEST(Elastic, RecoversAKnownWarp) {
  const std::vector<Eigen::MatrixXd> curves = {Sample(Curve),
                                               Sample([](double t) { return Curve(Late(t)); }),
                                               Sample([](double t) { return Curve(Uneven(t)); })};
  const auto warps = RegisterElastically(curves);
  for (const auto& warp : warps) ExpectIncreasing(warp);
  for (double t = 0.02; t < 1; t += 0.02) {
    EXPECT_NEAR(OtherTime(warps[1], warps[0], t), Late(t), 0.012) << t;
    EXPECT_NEAR(OtherTime(warps[2], warps[0], t), Uneven(t), 0.012) << t;
  }
}

TEST(Elastic, TheMeanOfTheWarpsIsEven) {
  const auto warps = RegisterElastically(
      std::vector<Eigen::MatrixXd>{Sample(Curve), Sample([](double t) { return Curve(Late(t)); })});
  for (std::size_t k = 0; k < warps[0].size(); ++k) {
    const double even = static_cast<double>(k) / static_cast<double>(warps[0].size() - 1);
    EXPECT_NEAR((warps[0][k] + warps[1][k]) / 2, even, 1e-9);
  }
}

TEST(Elastic, PlaceAndSizeOfACurveChangeNothing) {
  const Eigen::MatrixXd one = Sample(Curve);
  const Eigen::MatrixXd other = Sample([](double t) { return Curve(Late(t)); });
  const Eigen::MatrixXd moved = (8 * other).rowwise() + Eigen::RowVector2d(3, -2);
  const auto plain = RegisterElastically(std::vector<Eigen::MatrixXd>{one, other});
  const auto after = RegisterElastically(std::vector<Eigen::MatrixXd>{one, moved});
  for (std::size_t k = 0; k < plain[1].size(); ++k) EXPECT_NEAR(plain[1][k], after[1][k], 1e-6);
}

TEST(Elastic, AWarpOfAllCurvesChangesNoCorrespondence) {
  const auto bent = [](double t) -> Eigen::Vector2d {
    return Curve(t) + Eigen::Vector2d(0.03 * t, 0.05 * t * t);
  };
  const auto plain = RegisterElastically(
      std::vector<Eigen::MatrixXd>{Sample(Curve), Sample([&](double t) { return bent(Late(t)); })});
  const auto warped = RegisterElastically(
      std::vector<Eigen::MatrixXd>{Sample([](double t) { return Curve(Uneven(t)); }),
                                   Sample([&](double t) { return bent(Late(Uneven(t))); })});
  for (double t = 0.05; t < 1; t += 0.05) {
    const double other = OtherTime(plain[0], plain[1], Uneven(t));
    EXPECT_NEAR(Uneven(OtherTime(warped[0], warped[1], t)), other, 0.015) << t;
  }
}

/// Goes, rests from `from` to `to`, goes on.
Eigen::Vector2d WithPause(double t, double from, double to) {
  const double there = MinimumJerk(t / from);
  const double on = MinimumJerk((t - to) / (1 - to));
  return {0.3 * there + 0.2 * on, 0.1 * there - 0.2 * on};
}

TEST(Elastic, PausesOfOtherLengthsKeepWhatIsBetweenThemTogether) {
  Rng rng(1);
  const auto noisy = [&](double from, double to) {
    return Sample([&](double t) {
      return Eigen::Vector2d(WithPause(t, from, to) +
                             Eigen::Vector2d(rng.Normal(0, 1e-5), rng.Normal(0, 1e-5)));
    });
  };
  const auto warps = RegisterElastically(
      std::vector<Eigen::MatrixXd>{noisy(.3, .4), noisy(.25, .7), noisy(.35, .55)});
  for (const auto& warp : warps) ExpectIncreasing(warp);
  const auto middle = [&](std::size_t trial, double t) {
    return OtherTime(warps[trial], warps[0], t);
  };
  // Half the way there, half the way on.
  EXPECT_NEAR(middle(1, .125), .15, 0.015);
  EXPECT_NEAR(middle(1, .85), .7, 0.015);
  EXPECT_NEAR(middle(2, .175), .15, 0.015);
  EXPECT_NEAR(middle(2, .775), .7, 0.015);
}

TEST(Elastic, RestIsPassedEvenly) {
  Rng rng(2);
  std::vector<Eigen::MatrixXd> curves;
  for (int j = 0; j < 3; ++j) {
    curves.push_back(Sample([&](double t) {
      return Eigen::Vector2d(WithPause(t, .3, .7) +
                             Eigen::Vector2d(rng.Normal(0, 1e-5), rng.Normal(0, 1e-5)));
    }));
  }
  curves.push_back(Eigen::MatrixXd::Constant(kSamples + 1, 2, 0.7));
  for (const auto& warp : RegisterElastically(curves)) {
    for (std::size_t k = 0; k < warp.size(); ++k) {
      const double even = static_cast<double>(k) / static_cast<double>(warp.size() - 1);
      EXPECT_NEAR(warp[k], even, 0.02);
    }
  }
}

TEST(Elastic, AnyCurvesGetWarpsThatIncrease) {
  Rng rng(3);
  for (int round = 0; round < 20; ++round) {
    std::vector<Eigen::MatrixXd> curves;
    for (int j = 0; j < 3; ++j) {
      Eigen::MatrixXd curve(2 + static_cast<Eigen::Index>(rng.Below(60)), 3);
      for (double& value : curve.reshaped()) value = rng.Normal();
      curves.push_back(std::move(curve));
    }
    for (const auto& warp : RegisterElastically(curves, {.cells = 40})) ExpectIncreasing(warp);
  }
}

}  // namespace
}  // namespace exemplar::learning
