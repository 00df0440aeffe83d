#include "weighted_sum.hpp"

#include <gtest/gtest.h>

#include "exemplar/base/rng.hpp"

namespace exemplar::learning {
namespace {

Eigen::MatrixXd RandomMatrix(Rng& rng, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd matrix(rows, columns);
  for (Eigen::Index i = 0; i < matrix.size(); ++i) matrix.data()[i] = rng.Normal();
  return matrix;
}

TEST(Streams, SumsAreThoseOfPlainLoopsForAnyNumberOfRowsAndColumns) {
  Rng rng(1);
  for (const int rows : {1, 2, 7, 8, 9, 15, 16, 17, 64, 601}) {
    for (const int count : {1, 2, 3, 4, 5, 10, 31}) {
      const Eigen::MatrixXd columns = RandomMatrix(rng, rows, count);
      const Eigen::MatrixXd weights = RandomMatrix(rng, count, 3);
      const Streams streams(columns);
      EXPECT_EQ(streams.rows(), rows);
      EXPECT_EQ(streams.count(), count);
      const Eigen::VectorXd sum = streams.Sum(weights.col(0));
      const Eigen::MatrixX3d sum3 = streams.Sum3(weights);
      ASSERT_EQ(sum.size(), rows);
      ASSERT_EQ(sum3.rows(), rows);
      for (int row = 0; row < rows; ++row) {
        double expected[3] = {0, 0, 0};
        for (int k = 0; k < count; ++k) {
          for (int axis = 0; axis < 3; ++axis) expected[axis] += columns(row, k) * weights(k, axis);
        }
        EXPECT_NEAR(sum[row], expected[0], 1e-13 * count);
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_NEAR(sum3(row, axis), expected[axis], 1e-13 * count);
        }
      }
    }
  }
}

TEST(Streams, AreExactWhereTheSumIs) {
  // Independent values: sums of powers of two, worked out by hand.
  Eigen::MatrixXd columns(3, 2);
  columns << 1, 4, 2, 8, 0.5, -16;
  const Streams streams(columns);
  EXPECT_EQ(streams.Sum(Eigen::Vector2d(2, 0.25)), Eigen::Vector3d(3, 6, -3));
  Eigen::MatrixX3d weights(2, 3);
  weights << 2, 0, 1, 0.25, 1, 0;
  Eigen::MatrixX3d expected(3, 3);
  expected << 3, 4, 1, 6, 8, 2, -3, -16, 0.5;
  EXPECT_EQ(streams.Sum3(weights), expected);
}

TEST(Streams, WithoutRowsOrColumnsSumToNothing) {
  EXPECT_EQ(Streams().Sum(Eigen::VectorXd()).size(), 0);
  EXPECT_EQ(Streams(Eigen::MatrixXd(0, 4)).Sum(Eigen::Vector4d::Ones()).size(), 0);
  EXPECT_EQ(Streams(Eigen::MatrixXd(5, 0)).Sum(Eigen::VectorXd()), Eigen::VectorXd::Zero(5));
  EXPECT_EQ(Streams(Eigen::MatrixXd(5, 0)).Sum3(Eigen::MatrixX3d(0, 3)),
            Eigen::MatrixXd::Zero(5, 3));
}

TEST(Streams, SumToAMatrixOfTheSameNumbers) {
  Rng rng(2);
  const Eigen::MatrixXd columns = RandomMatrix(rng, 21, 4);
  const Eigen::VectorXd weights = RandomMatrix(rng, 4, 1);
  const Streams streams(columns);
  EXPECT_EQ(streams.Sum(weights, 7, 3), streams.Sum(weights).reshaped(7, 3));
}

TEST(RoundedStreams, AreOffByNoMoreThanTheRoundingOfTheirDistancesFromTheMean) {
  Rng rng(3);
  for (const int rows : {1, 7, 8, 9, 16, 601}) {
    for (const int count : {1, 2, 5, 10, 31}) {
      // Far from zero beside what they differ by.
      const Eigen::MatrixXd columns = RandomMatrix(rng, rows, count).array() + 100;
      const Eigen::VectorXd weights = RandomMatrix(rng, count, 1);
      const Eigen::MatrixXd sum = RoundedStreams(columns).Sum(weights, rows, 1);
      const Eigen::VectorXd expected = columns * weights;
      const double furthest = (columns.colwise() - columns.rowwise().mean()).cwiseAbs().maxCoeff();
      const double bound = 0x1p-32 * furthest * weights.cwiseAbs().sum() + 1e-12 * count;
      ASSERT_EQ(sum.rows(), rows);
      EXPECT_LE((sum - expected).cwiseAbs().maxCoeff(), bound) << rows << " rows of " << count;
    }
  }
}

TEST(RoundedStreams, OfEqualColumnsAreExact) {
  const Eigen::VectorXd column = Eigen::VectorXd::LinSpaced(12, -1, 2.5);
  const RoundedStreams streams(column.replicate(1, 2));
  EXPECT_EQ(streams.Sum(Eigen::Vector2d(0.75, 0.25), 4, 3), column.reshaped(4, 3));
}

TEST(RoundedStreams, WithoutRowsOrColumnsSumToNothing) {
  EXPECT_EQ(RoundedStreams().Sum(Eigen::VectorXd(), 0, 0).size(), 0);
  EXPECT_EQ(RoundedStreams(Eigen::MatrixXd(0, 4)).Sum(Eigen::Vector4d::Ones(), 6, 0).rows(), 6);
  EXPECT_EQ(RoundedStreams(Eigen::MatrixXd(4, 0)).Sum(Eigen::VectorXd(), 2, 2),
            Eigen::MatrixXd::Zero(2, 2));
}

}  // namespace
}  // namespace exemplar::learning
