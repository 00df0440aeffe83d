#include "block_kriging.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numeric>

#include "exemplar/base/rng.hpp"
#include "exemplar/geometry/pose.hpp"

namespace exemplar::learning {
namespace {

Eigen::MatrixXd RandomMatrix(Rng& rng, Eigen::Index rows, Eigen::Index cols) {
  return Eigen::MatrixXd::NullaryExpr(rows, cols, [&] { return rng.Normal(); });
}

PartedCovariance RandomCovariance(Rng& rng, int n, bool similar, bool turned) {
  PartedCovariance covariance;
  covariance.parts = RandomMatrix(rng, 3 * n, 7);
  covariance.parts.leftCols<3>() *= 300;  // what is left to the data has a gain of 1e5
  if (!similar) return covariance;
  const Eigen::MatrixXd places = RandomMatrix(rng, n, 3);
  covariance.similarity.resize(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      covariance.similarity(i, j) = 5 * std::exp(-(places.row(i) - places.row(j)).norm());
    }
    if (turned) {
      covariance.turns.push_back(
          geometry::ExpSo3({rng.Normal(), rng.Normal(), rng.Normal()}).toRotationMatrix());
    }
  }
  return covariance;
}

Eigen::MatrixXd WithNoise(const PartedCovariance& covariance) {
  const Eigen::Index n = covariance.parts.rows() / 3;
  Eigen::MatrixXd total =
      covariance.parts * covariance.parts.transpose() + Eigen::MatrixXd::Identity(3 * n, 3 * n);
  for (Eigen::Index i = 0; i < covariance.similarity.rows(); ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
      if (!covariance.turns.empty()) {
        turn = covariance.turns[static_cast<std::size_t>(i)] *
               covariance.turns[static_cast<std::size_t>(j)].transpose();
      }
      total.block<3, 3>(3 * i, 3 * j) += covariance.similarity(i, j) * turn;
    }
  }
  return total;
}

// Whether the trials are few, with one inverse, or many, with Woodbury's.
TEST(BlockKriging, SolvesWithTheWholeCovarianceHoweverManyTrials) {
  Rng rng(1);
  for (const int n : {1, 2, 7, 30, 31, 60}) {
    for (const bool similar : {false, true}) {
      for (const bool turned : {false, true}) {
        const PartedCovariance covariance = RandomCovariance(rng, n, similar, turned);
        const BlockKriging kriging(covariance);
        const Eigen::LLT<Eigen::MatrixXd> whole(WithNoise(covariance));
        const Eigen::MatrixXd values = RandomMatrix(rng, 3 * n, 5);
        EXPECT_LT((kriging.Duals(values) - whole.solve(values)).norm(), 1e-8 * values.norm()) << n;
        EXPECT_EQ(kriging.inverse().rows(), n <= 30 ? 3 * n : 0);
      }
    }
  }
}

TEST(BlockKriging, LeftOutErrorsAreThoseOfFittingTheOthers) {
  Rng rng(2);
  for (const int n : {3, 12, 40}) {
    const PartedCovariance covariance = RandomCovariance(rng, n, true, n != 12);
    const Eigen::MatrixXd total = WithNoise(covariance);
    const Eigen::MatrixXd values = RandomMatrix(rng, 3 * n, 70);
    Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(3 * n, 70);
    const Eigen::VectorXd noise = BlockKriging(covariance).AddLeftOutErrors(values, 0.5, errors);
    EXPECT_EQ(noise.size(), 70);
    EXPECT_GT(noise.minCoeff(), 0);
    for (const int out : {0, n / 2, n - 1}) {
      std::vector<int> kept;
      for (int row = 0; row < 3 * n; ++row) {
        if (row / 3 != out) kept.push_back(row);
      }
      const Eigen::MatrixXd others = total(kept, kept);
      const Eigen::MatrixXd cross = total.middleRows<3>(3 * out)(Eigen::all, kept);
      const Eigen::MatrixXd predicted =
          cross * Eigen::LLT<Eigen::MatrixXd>(others).solve(values(kept, Eigen::all));
      EXPECT_LT(
          (2 * errors.middleRows<3>(3 * out) - (values.middleRows<3>(3 * out) - predicted)).norm(),
          1e-6)
          << n << " " << out;
    }
  }
}

TEST(EvenChoice, TakesAllOrAnEvenPart) {
  EXPECT_EQ(EvenChoice(3, 5), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(EvenChoice(1000, 4), (std::vector<int>{0, 250, 500, 750}));
}

}  // namespace
}  // namespace exemplar::learning
