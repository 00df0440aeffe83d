#include "exemplar/learning/hermite.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "exemplar/base/rng.hpp"

namespace exemplar::learning {
namespace {

// PAPER.md section 4.
TEST(MonotoneHermite, MeetsTheCheckValuesOfFritschAndCarlson) {
  const std::vector<double> x = {0, .3, .6, 1};
  const std::vector<double> y = {0, .5, .55, 1};
  const MonotoneHermite warp(x, y);
  const std::vector<double> tangents = {1.6666667, .4087412, .2879768, 1.125};
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(warp.tangents()[k], tangents[k], 5e-8);
  EXPECT_NEAR(warp(.15), .2971722, 5e-8);
  EXPECT_NEAR(warp(.45), .5295287, 5e-8);
  EXPECT_NEAR(warp(.8), .7331488, 5e-8);
}

TEST(MonotoneHermite, FlatStretchesStayFlat) {
  const MonotoneHermite warp({0, 1, 2, 3}, {0, 1, 1, 2});
  for (double x = 1; x <= 2; x += 0.05) EXPECT_DOUBLE_EQ(warp(x), 1);
}

TEST(MonotoneHermite, HoldsItsEndsOutside) {
  const MonotoneHermite warp({1, 2}, {3, 5});
  EXPECT_EQ(warp(-4), 3);
  EXPECT_EQ(warp(9), 5);
  EXPECT_DOUBLE_EQ(warp(1.5), 4);
}

TEST(MonotoneHermite, EvenKnotsGiveTheIdentity) {
  const MonotoneHermite warp({0, .1, .7, 2}, {0, .1, .7, 2});
  for (double x = 0; x <= 2; x += 0.01) EXPECT_NEAR(warp(x), x, 1e-14);
}

TEST(MonotoneHermite, RisesThroughItsKnotsWhateverTheyAre) {
  Rng rng(1);
  for (int trial = 0; trial < 3000; ++trial) {
    const std::size_t n = 2 + rng.Below(8);
    std::vector<double> x = {rng.Uniform(-1, 1)};
    std::vector<double> y = {rng.Uniform(-1, 1)};
    while (x.size() < n) {
      // Steps over three decades: strong distortion.
      x.push_back(x.back() + std::exp(rng.Uniform(-6, 1)));
      y.push_back(y.back() + std::exp(rng.Uniform(-6, 1)));
    }
    const MonotoneHermite warp(x, y);
    for (std::size_t k = 0; k < n; ++k) EXPECT_NEAR(warp(x[k]), y[k], 1e-12);
    double before = y.front();
    for (int p = 0; p <= 400; ++p) {
      const double now = warp(x.front() + (x.back() - x.front()) * p / 400);
      ASSERT_GE(now, before - 1e-12) << "trial " << trial;
      before = now;
    }
  }
}

}  // namespace
}  // namespace exemplar::learning
