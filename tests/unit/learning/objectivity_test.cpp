#include "exemplar/learning/objectivity.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace exemplar::learning {
namespace {

using Eigen::MatrixXd;
using Eigen::RowVector3d;

// PAPER.md section 5.4, "Check": three trials at start, half way, and at their object.
struct CheckTrials {
  std::vector<MatrixXd> base, object;
  CheckTrials() {
    const RowVector3d starts[] = {{0, 0, 0}, {.02, 0, 0}, {0, .02, 0}};
    const RowVector3d objects[] = {{.4, 0, 0}, {.5, .1, 0}, {.4, .2, .1}};
    for (int j = 0; j < 3; ++j) {
      MatrixXd path(3, 3);
      path << starts[j], (starts[j] + objects[j]) / 2, objects[j];
      base.push_back(path);
      object.push_back(path.rowwise() - objects[j]);
    }
  }
};

TEST(Objectivity, GivesTheCheckValues) {
  const CheckTrials trials;
  const Objectivity o = ComputeObjectivity(trials.base, trials.object, std::nullopt);
  EXPECT_NEAR(o.upsilon[0], .0192307692, 1e-9);
  EXPECT_NEAR(o.upsilon[1], .5984251969, 1e-9);
  EXPECT_DOUBLE_EQ(o.upsilon[2], 1);
  EXPECT_FALSE(o.undefined);
}

TEST(Objectivity, IsHalfWhereAllTrialsHaveOneObjectPosition) {
  const CheckTrials trials;
  std::vector<MatrixXd> moved;
  for (const MatrixXd& path : trials.base) moved.push_back(path.rowwise() - RowVector3d(1, 2, 3));
  const Objectivity o = ComputeObjectivity(trials.base, moved, std::nullopt);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(o.upsilon[i], .5, 1e-12);
}

TEST(Objectivity, OfOneTrialIsOneFromContactOn) {
  const CheckTrials trials;
  const Objectivity o =
      ComputeObjectivity(std::span(trials.base).first(1), std::span(trials.object).first(1), 1);
  EXPECT_TRUE(o.undefined);
  EXPECT_EQ(o.upsilon[0], 0);
  EXPECT_EQ(o.upsilon[1], 1);
  EXPECT_EQ(o.upsilon[2], 1);
}

}  // namespace
}  // namespace exemplar::learning
