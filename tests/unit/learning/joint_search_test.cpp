#include "joint_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "exemplar/base/rng.hpp"

namespace exemplar::learning {
namespace {

PairwiseWorth RandomWorth(Rng& rng, std::size_t variables, std::size_t most_labels) {
  std::vector<std::size_t> labels;
  for (std::size_t i = 0; i < variables; ++i) labels.push_back(1 + rng.Below(most_labels));
  PairwiseWorth worth(labels);
  for (std::size_t i = 0; i < variables; ++i) {
    for (std::size_t j = i + 1; j < variables; ++j) {
      for (std::size_t a = 0; a < labels[i]; ++a) {
        for (std::size_t b = 0; b < labels[j]; ++b) worth.At(i, a, j, b) = rng.Uniform(-1, 1);
      }
    }
  }
  return worth;
}

double Exhaust(const PairwiseWorth& worth) {
  double best = -1e300;
  std::vector<std::size_t> at(worth.variables(), 0);
  for (bool more = true; more;) {
    best = std::max(best, worth.Sum(at));
    more = false;
    for (std::size_t i = 0; i < at.size() && !more; ++i) {
      more = ++at[i] < worth.labels(i);
      if (!more) at[i] = 0;
    }
  }
  return best;
}

TEST(MaximiseJointly, ReachesTheExhaustedOptimumAndProvesIt) {
  Rng rng(1);
  for (int round = 0; round < 3000; ++round) {
    const PairwiseWorth worth = RandomWorth(rng, 2 + rng.Below(4), 5);
    const JointOptimum optimum = MaximiseJointly(worth, 1e9);
    EXPECT_NEAR(optimum.value, Exhaust(worth), 1e-9) << "round " << round;
    EXPECT_NEAR(optimum.value, worth.Sum(optimum.chosen), 1e-12);
    EXPECT_NEAR(optimum.bound, optimum.value, 1e-8);
  }
}

TEST(MaximiseJointly, ItsBoundHoldsWhenTheSearchIsCutShort) {
  Rng rng(2);
  int open = 0;
  for (int round = 0; round < 500; ++round) {
    const PairwiseWorth worth = RandomWorth(rng, 5, 6);
    const double best = Exhaust(worth);
    for (const double steps : {0.0, 20.0, 200.0}) {
      const JointOptimum optimum = MaximiseJointly(worth, steps);
      EXPECT_LE(optimum.value, best + 1e-9);
      EXPECT_GE(optimum.bound, best - 1e-9);
      if (optimum.bound > optimum.value + 1e-6) ++open;
    }
  }
  EXPECT_GT(open, 0);  // else this would prove nothing
}

TEST(MaximiseJointly, OneVariableHasNothingToAgreeOn) {
  const JointOptimum optimum = MaximiseJointly(PairwiseWorth({3}), 1e6);
  EXPECT_EQ(optimum.chosen.size(), 1u);
  EXPECT_EQ(optimum.value, 0);
  EXPECT_EQ(optimum.bound, 0);
}

}  // namespace
}  // namespace exemplar::learning
