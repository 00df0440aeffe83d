#include "exemplar/signal/statistics.hpp"

#include <gtest/gtest.h>

#include "exemplar/base/rng.hpp"

namespace exemplar::signal {
namespace {

Eigen::VectorXd RandomVector(Rng& rng, int n) {
  Eigen::VectorXd v(n);
  for (double& x : v) x = rng.Normal();
  return v;
}

TEST(Statistics, QuantileInterpolatesBetweenOrderStatistics) {
  const std::vector<double> values = {4, 1, 3, 2};
  EXPECT_DOUBLE_EQ(Quantile(values, 0), 1);
  EXPECT_DOUBLE_EQ(Quantile(values, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(Quantile(values, 0.9), 3.7);
  EXPECT_DOUBLE_EQ(Quantile(values, 1), 4);
  EXPECT_DOUBLE_EQ(Quantile(std::vector<double>{7}, 0.3), 7);
}

TEST(Statistics, DeviationDividesByTheNumberOfValues) {
  EXPECT_DOUBLE_EQ(Deviation(Eigen::Vector2d(1, 3)), 1);
  EXPECT_DOUBLE_EQ(Deviation(Eigen::VectorXd::Constant(1, 5)), 0);
}

TEST(Statistics, NoiseDeviationIgnoresTrendAndSteps) {
  Rng rng(1);
  Eigen::VectorXd v(4000);
  for (Eigen::Index k = 0; k < v.size(); ++k) {
    v[k] = rng.Normal(0, 0.01) + 0.001 * static_cast<double>(k) + (k > 2000 ? 5 : 0);
  }
  EXPECT_NEAR(NoiseDeviation(v), 0.01, 0.0006);
}

TEST(Statistics, CorrelationIsInvariantToScaleAndShift) {
  Rng rng(2);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::VectorXd a = RandomVector(rng, 30);
    const Eigen::VectorXd b = RandomVector(rng, 30);
    const double r = Correlation(a, b);
    EXPECT_LE(std::abs(r), 1);
    EXPECT_NEAR(Correlation(b, a), r, 1e-14);
    const Eigen::VectorXd moved = (a.array() * 3.5 + 100).matrix();
    EXPECT_NEAR(Correlation(moved, b), r, 1e-12);
    EXPECT_NEAR(Correlation(-a, b), -r, 1e-14);
    EXPECT_NEAR(Correlation(a, a), 1, 1e-14);
  }
}

TEST(Statistics, CorrelationWithAConstantIsZero) {
  Rng rng(3);
  const Eigen::VectorXd constant = Eigen::VectorXd::Constant(50, 0.1);
  EXPECT_EQ(Correlation(constant, RandomVector(rng, 50)), 0);
  EXPECT_EQ(Correlation(constant, constant), 0);
}

}  // namespace
}  // namespace exemplar::signal
