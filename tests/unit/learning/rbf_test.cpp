#include "exemplar/learning/rbf.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "exemplar/base/rng.hpp"

namespace exemplar::learning {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// PAPER.md section 5.2, "Check".
MatrixXd CheckPositions() {
  MatrixXd p(5, 3);
  p << 0, 0, 0, .3, 0, .1, 0, .4, .05, .3, .35, 0, .15, .2, .2;
  return p;
}
VectorXd CheckValues() {
  VectorXd f(5);
  f << 0, .5, -.2, .4, .9;
  return f;
}
const Vector3d kCheckQuery(.1, .1, .05);

MatrixXd RandomPositions(int n, Rng& rng) {
  MatrixXd p(n, 3);
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < 3; ++k) p(i, k) = rng.Uniform(-1, 1);
  }
  return p;
}

void ExpectNear(const VectorXd& actual, std::initializer_list<double> expected, double tolerance) {
  ASSERT_EQ(actual.size(), static_cast<Eigen::Index>(expected.size()));
  Eigen::Index i = 0;
  for (const double e : expected) {
    EXPECT_NEAR(actual[i], e, tolerance) << "at " << i;
    ++i;
  }
}

TEST(CardinalRbf, GivesTheCheckWeightsOfTheAffineTrend) {
  const CardinalRbf rbf(CheckPositions(), {.trend = Trend::kAffine});
  const VectorXd w = rbf.Weights(kCheckQuery);
  ExpectNear(w, {.507523186, .153124932, .082771101, .103836022, .152744759}, 1e-9);
  EXPECT_NEAR(w.dot(CheckValues()), .239012937, 1e-9);
}

TEST(CardinalRbf, GivesTheCheckCoefficientsOfTheAffineTrend) {
  const CardinalRbf rbf(CheckPositions(), {.trend = Trend::kAffine});
  const CardinalRbf::Coefficients s = rbf.Solve(CheckValues());
  ExpectNear(s.lambda, {-.559583536, 1.007250364, .927309859, -.639524041, -.735452647}, 1e-8);
  ExpectNear(s.c, {-.162065338, 1.512498088, -.205057529, 3.501212757}, 1e-8);
}

TEST(CardinalRbf, GivesTheCheckLeaveOneOutErrors) {
  const CardinalRbf affine(CheckPositions(), {.trend = Trend::kAffine});
  ExpectNear(affine.LeaveOneOut(CheckValues()),
             {1.071428571, -.595238095, -.646551724, .9375, .815217391}, 1e-8);
  const CardinalRbf constant(CheckPositions(), {.trend = Trend::kConstant});
  ExpectNear(constant.LeaveOneOut(CheckValues()),
             {-.361426856, -.085365515, -.676266453, .087715973, .712940599}, 1e-8);
}

TEST(CardinalRbf, GivesTheCheckWeightsOfTheConstantTrend) {
  const CardinalRbf rbf(CheckPositions(), {.trend = Trend::kConstant});
  const VectorXd w = rbf.Weights(kCheckQuery);
  ExpectNear(w, {.450149105, .164138140, .073360712, .058783820, .253568225}, 1e-9);
  EXPECT_NEAR(w.dot(CheckValues()), .319121857, 1e-9);
}

TEST(CardinalRbf, WeightsAndCoefficientsGiveTheSameValue) {
  Rng rng(7);
  for (int round = 0; round < 200; ++round) {
    const int n = 1 + static_cast<int>(rng.Below(9));
    const MatrixXd p = RandomPositions(n, rng);
    const CardinalRbf rbf(p, {.trend = round % 2 == 0 ? Trend::kAffine : Trend::kConstant});
    const VectorXd f = RandomPositions(n, rng).col(0);
    const Vector3d query = RandomPositions(1, rng).row(0).transpose() * 2;
    const CardinalRbf::Coefficients s = rbf.Solve(f);
    double value = s.c[0] + s.c.tail(3).dot(query);
    for (int j = 0; j < n; ++j) value += s.lambda[j] * (query - p.row(j).transpose()).norm();
    EXPECT_NEAR(rbf.Weights(query).dot(f), value, 1e-9);
  }
}

TEST(CardinalRbf, AffineWeightsReproduceOneAndThePositionItself) {
  Rng rng(8);
  for (int round = 0; round < 200; ++round) {
    const int n = 4 + static_cast<int>(rng.Below(8));
    const MatrixXd p = RandomPositions(n, rng);
    const CardinalRbf rbf(p, {.trend = Trend::kAffine});
    const Vector3d query = RandomPositions(1, rng).row(0).transpose() * 3;
    const VectorXd w = rbf.Weights(query);
    EXPECT_NEAR(w.sum(), 1, 1e-9);
    EXPECT_LT((p.transpose() * w - query).norm(), 1e-8);
    for (int k = 0; k < n; ++k) {
      EXPECT_LT((rbf.Weights(p.row(k).transpose()) - VectorXd::Unit(n, k)).norm(), 1e-8);
    }
  }
}

TEST(CardinalRbf, LeaveOneOutEqualsFittingWithoutTheTrial) {
  Rng rng(9);
  for (int round = 0; round < 100; ++round) {
    const int n = 6 + static_cast<int>(rng.Below(5));
    const MatrixXd p = RandomPositions(n, rng);
    const VectorXd f = RandomPositions(n, rng).col(1);
    // With a ridge given as part of the mean distance, leaving a trial out changes the ridge
    // itself; without one the two agree exactly.
    for (const Trend trend : {Trend::kAffine, Trend::kConstant}) {
      const MatrixXd errors = CardinalRbf(p, {.trend = trend}).LeaveOneOut(f);
      for (int k = 0; k < n; ++k) {
        MatrixXd others(n - 1, 3);
        VectorXd values(n - 1);
        for (int i = 0, row = 0; i < n; ++i) {
          if (i == k) continue;
          others.row(row) = p.row(i);
          values[row++] = f[i];
        }
        const CardinalRbf without(others, {.trend = trend});
        EXPECT_NEAR(errors(k, 0), f[k] - without.Weights(p.row(k).transpose()).dot(values), 1e-7);
      }
    }
  }
}

TEST(CardinalRbf, LeftOutWeightsAreThoseOfFittingTheOthers) {
  Rng rng(12);
  for (const int n : {7, 120}) {
    Eigen::MatrixXd positions =
        Eigen::MatrixXd::NullaryExpr(n, 3, [&] { return rng.Uniform(-1, 1); });
    positions.row(5) = positions.row(2);  // a place that was shown twice
    for (const Trend trend : {Trend::kConstant, Trend::kAffine}) {
      const RbfOptions options{.trend = trend, .ridge = 0};
      const CardinalRbf all(positions, options);
      for (int out = 0; out < n; out += n / 7) {
        std::vector<int> kept;
        for (int j = 0; j < n; ++j) {
          if (j != out) kept.push_back(j);
        }
        const CardinalRbf others(positions(kept, Eigen::all), options);
        const Eigen::VectorXd weights = all.LeftOutWeights(out);
        EXPECT_EQ(weights[out], 0);
        EXPECT_NEAR(weights.sum(), 1, 1e-9);
        EXPECT_LT((weights(kept) - others.Weights(positions.row(out).transpose())).norm(), 1e-7)
            << n << " " << out;
      }
    }
  }
}

TEST(CardinalRbf, AnswersForCoplanarPositionsWithTheTrendOfTheirPlane) {
  Rng rng(10);
  MatrixXd p = RandomPositions(6, rng);
  p.col(2).setConstant(.7);  // a table
  const CardinalRbf rbf(p, {.trend = Trend::kAffine});
  EXPECT_EQ(rbf.rank(), 2);
  const Vector3d query(.3, -.2, .7);
  const VectorXd w = rbf.Weights(query);
  EXPECT_NEAR(w.sum(), 1, 1e-9);
  EXPECT_LT((p.transpose() * w - query).norm(), 1e-8);
  EXPECT_LT((rbf.Weights(p.row(2).transpose()) - VectorXd::Unit(6, 2)).norm(), 1e-8);
  EXPECT_LT(rbf.Weights(Vector3d(.3, -.2, 1.7)).norm(), 10);
}

TEST(CardinalRbf, AnswersForCollinearRepeatedAndSinglePositions) {
  MatrixXd line(3, 3);
  line << 0, 0, 0, 1, 1, 1, 2, 2, 2;
  const CardinalRbf collinear(line, {.trend = Trend::kAffine});
  EXPECT_EQ(collinear.rank(), 1);
  EXPECT_LT(
      (line.transpose() * collinear.Weights(Vector3d::Constant(1.5)) - Vector3d::Constant(1.5))
          .norm(),
      1e-9);

  MatrixXd repeated(4, 3);
  repeated << 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0;
  const VectorXd at_pair = CardinalRbf(repeated, {}).Weights(Vector3d::Zero());
  ExpectNear(at_pair, {.5, 0, .5, 0}, 1e-9);

  const MatrixXd same = MatrixXd::Constant(3, 3, .4);
  ExpectNear(CardinalRbf(same, {}).Weights(Vector3d(5, 5, 5)), {1. / 3, 1. / 3, 1. / 3}, 1e-12);
  ExpectNear(CardinalRbf(same.topRows(1), {}).Weights(Vector3d(5, 5, 5)), {1}, 1e-12);
}

TEST(CardinalRbf, LeavesOneOfARepeatedPairOutAgainstTheOther) {
  MatrixXd p(5, 3);
  p << 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 1, 1, 0;
  VectorXd f(5);
  f << 1, 5, 3, 7, 2;
  const MatrixXd errors = CardinalRbf(p, {}).LeaveOneOut(f);
  EXPECT_NEAR(errors(0, 0), 1 - 3, 1e-12);
  EXPECT_NEAR(errors(2, 0), 3 - 1, 1e-12);
}

TEST(CardinalRbf, RidgeSmoothsNoiseTowardsTheTrend) {
  const VectorXd f = CheckValues();
  const MatrixXd p = CheckPositions();
  const auto misfit = [&](double ridge) {
    const CardinalRbf rbf(p, {.trend = Trend::kConstant, .ridge = ridge});
    double sum = 0;
    for (int k = 0; k < 5; ++k) {
      sum += std::abs(rbf.Weights(p.row(k).transpose()).dot(f) - f[k]);
    }
    return sum;
  };
  EXPECT_NEAR(misfit(0), 0, 1e-9);
  EXPECT_LT(misfit(.1), misfit(1));
  const CardinalRbf flat(p, {.trend = Trend::kConstant, .ridge = 1e4});
  EXPECT_LT((flat.Weights(kCheckQuery) - VectorXd::Constant(5, .2)).norm(), 1e-3);
}

TEST(CardinalRbf, VarianceIsZeroAtTheTrialsAndGrowsAway) {
  const CardinalRbf rbf(CheckPositions(), {.trend = Trend::kConstant});
  EXPECT_NEAR(rbf.Variance(CheckPositions().row(1).transpose()), 0, 1e-9);
  EXPECT_GT(rbf.Variance(kCheckQuery), 0);
  EXPECT_GT(rbf.Variance(Vector3d(3, 3, 3)), rbf.Variance(Vector3d(1, 1, 1)));
  EXPECT_GT(rbf.MeanLeaveOneOutVariance(), 0);
}

}  // namespace
}  // namespace exemplar::learning
