#include "exemplar/signal/derivative.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace exemplar::signal {
namespace {

TEST(Derivative, IsExactOnParabolasUpToBothEnds) {
  Eigen::MatrixXd x(9, 2);
  for (int k = 0; k < 9; ++k) {
    const double t = 0.1 * k;
    x(k, 0) = 2 + 3 * t - 4 * t * t;
    x(k, 1) = t;
  }
  const Eigen::MatrixXd rate = Derivative(x, 0.1);
  for (int k = 0; k < 9; ++k) {
    EXPECT_NEAR(rate(k, 0), 3 - 8 * 0.1 * k, 1e-12);
    EXPECT_NEAR(rate(k, 1), 1, 1e-12);
  }
}

TEST(Derivative, ErrorFallsWithTheSquareOfTheStep) {
  const auto largest_error = [](int n) {
    const double step_s = 2.0 / (n - 1);
    Eigen::MatrixXd x(n, 1);
    for (int k = 0; k < n; ++k) x(k, 0) = std::sin(3 * step_s * k);
    const Eigen::MatrixXd rate = Derivative(x, step_s);
    double largest = 0;
    for (int k = 0; k < n; ++k) {
      largest = std::max(largest, std::abs(rate(k, 0) - 3 * std::cos(3 * step_s * k)));
    }
    return largest;
  };
  EXPECT_NEAR(largest_error(101) / largest_error(201), 4, 0.2);
}

TEST(Derivative, OfTooFewSamplesIsTheBestThereIs) {
  EXPECT_EQ(Derivative(Eigen::MatrixXd::Constant(1, 2, 5.0), 0.1), Eigen::MatrixXd::Zero(1, 2));
  Eigen::MatrixXd two(2, 1);
  two << 1, 2;
  EXPECT_EQ(Derivative(two, 0.5), Eigen::MatrixXd::Constant(2, 1, 2.0));
}

}  // namespace
}  // namespace exemplar::signal
