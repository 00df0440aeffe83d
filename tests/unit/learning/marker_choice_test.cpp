#include "exemplar/learning/marker_choice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "exemplar/base/rng.hpp"
#include "pair_correlator.hpp"
#include "subsets.hpp"

namespace exemplar::learning {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int kPoints = 40;

// Bumps at the candidates, each of a height of its own.
MarkerCandidates RandomTrial(Rng& rng, std::size_t candidates) {
  MarkerCandidates trial;
  trial.id = "t" + std::to_string(rng.Below(1000));
  trial.duration_s = rng.Uniform(2, 6);
  const auto samples = static_cast<Eigen::Index>(30 + rng.Below(60));
  trial.signal = Eigen::VectorXd::Zero(samples);
  const double room = trial.duration_s / static_cast<double>(candidates + 1);
  for (std::size_t c = 0; c < candidates; ++c) {
    trial.time_s.push_back(room * (static_cast<double>(c) + rng.Uniform(0.3, 1.2)));
    trial.score.push_back(rng.Uniform(1, 3));
    for (Eigen::Index k = 0; k < samples; ++k) {
      const double t = trial.duration_s * static_cast<double>(k) / static_cast<double>(samples - 1);
      const double off = (t - trial.time_s.back() - 0.3 * room) / (0.3 * room);
      trial.signal[k] += trial.score.back() * std::exp(-off * off);
    }
  }
  return trial;
}

std::vector<int> All(std::size_t n) {
  std::vector<int> all(n);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

struct Case {
  std::vector<MarkerCandidates> trials;
  std::vector<std::vector<Subset>> subsets;
};
Case RandomCase(Rng& rng, std::size_t most_trials, std::size_t most_candidates) {
  Case made;
  std::size_t size = most_candidates;
  const std::size_t n = 2 + rng.Below(most_trials - 1);
  for (std::size_t i = 0; i < n; ++i) {
    made.trials.push_back(RandomTrial(rng, 1 + rng.Below(most_candidates)));
    size = std::min(size, made.trials.back().time_s.size());
  }
  for (const MarkerCandidates& trial : made.trials) {
    made.subsets.push_back(AllSubsets(All(trial.time_s.size()), size));
  }
  return made;
}

// The paper's score of every subset, step by step (PAPER.md section 4).
std::vector<std::vector<double>> VotesByExhaustion(const Case& c) {
  std::vector<std::vector<double>> votes;
  for (std::size_t i = 0; i < c.trials.size(); ++i) {
    votes.emplace_back();
    for (const Subset& mine : c.subsets[i]) {
      double sum = 0;
      for (std::size_t j = 0; j < c.trials.size(); ++j) {
        if (j == i) continue;
        for (const Subset& other : c.subsets[j]) {
          sum += PairCorrelation(c.trials[i], mine, c.trials[j], other, kPoints);
        }
      }
      votes.back().push_back(sum);
    }
  }
  return votes;
}

TEST(PairCorrelator, GivesPairCorrelationOfEveryPairOfSubsets) {
  Rng rng(1);
  for (int round = 0; round < 300; ++round) {
    const MarkerCandidates a = RandomTrial(rng, 1 + rng.Below(7));
    const MarkerCandidates b = RandomTrial(rng, 1 + rng.Below(7));
    const std::size_t size = 1 + rng.Below(std::min(a.time_s.size(), b.time_s.size()));
    const auto a_subsets = AllSubsets(All(a.time_s.size()), size);
    const auto b_subsets = AllSubsets(All(b.time_s.size()), size);
    const CorrelatedTrial ready_a(a);
    const CorrelatedTrial ready_b(b);
    PairCorrelator pair(ready_a, ready_b, kPoints, 100);
    std::vector<int> seen(a_subsets.size() * b_subsets.size(), 0);
    pair.CorrelateAll(All(a.time_s.size()), All(b.time_s.size()), size,
                      [&](std::size_t i, std::size_t j, double r) {
                        ++seen[i * b_subsets.size() + j];
                        EXPECT_NEAR(r, PairCorrelation(a, a_subsets[i], b, b_subsets[j], kPoints),
                                    1e-11);
                      });
    for (const int times : seen) EXPECT_EQ(times, 1);
    const Subset& some = a_subsets[rng.Below(a_subsets.size())];
    const Subset& other = b_subsets[rng.Below(b_subsets.size())];
    EXPECT_NEAR(pair.Correlate(some, other), PairCorrelation(a, some, b, other, kPoints), 1e-11);
  }
}

TEST(PairCorrelator, ComputesLessThanATenthOfTheStretchesThatPairsHave) {
  Rng rng(2);
  const MarkerCandidates a = RandomTrial(rng, 10);
  const MarkerCandidates b = RandomTrial(rng, 10);
  const CorrelatedTrial ready_a(a);
  const CorrelatedTrial ready_b(b);
  const std::size_t size = 7;
  const double pairs = std::pow(Binomial(10, size), 2);
  PairCorrelator pair(ready_a, ready_b, kPoints, pairs);
  double taken = 0;
  pair.CorrelateAll(All(10), All(10), size, [&](std::size_t, std::size_t, double) { taken += 1; });
  EXPECT_EQ(taken, pairs);
  EXPECT_LT(static_cast<double>(pair.computed_stretches()),
            pairs * static_cast<double>(size + 1) / 10);
}

// What a vote costs beside correlating each pair of subsets by itself: 16 multiply-adds a point of
// the grid that is computed (pair_correlator.hpp), against 55 for each point of each pair (24 for
// either signal: its time, its place between knots, the spline, the value between samples; 7 for
// r). Every stretch of a warp through one or two markers bears on all knots, so nothing is shared
// there but the cheaper arithmetic.
TEST(PairCorrelator, CostsATenthOfCorrelatingEachPairOnceStretchesAreAlike) {
  const auto saving = [](std::size_t size, std::size_t candidates) {
    Rng rng(11);
    const MarkerCandidates a = RandomTrial(rng, candidates);
    const MarkerCandidates b = RandomTrial(rng, candidates);
    const CorrelatedTrial ready_a(a);
    const CorrelatedTrial ready_b(b);
    constexpr int kFine = 240;
    const double pairs = std::pow(Binomial(candidates, size), 2);
    PairCorrelator pair(ready_a, ready_b, kFine, pairs);
    pair.CorrelateAll(All(candidates), All(candidates), size,
                      [](std::size_t, std::size_t, double) {});
    return 55 * pairs * kFine / (16 * static_cast<double>(pair.computed_points()));
  };
  EXPECT_GE(saving(1, 24), 3.4);
  EXPECT_GE(saving(2, 12), 3.4);
  EXPECT_GE(saving(3, 9), 4);
  EXPECT_GE(saving(4, 8), 5);
  EXPECT_GE(saving(6, 9), 10);
  EXPECT_GE(saving(7, 10), 20);
}

TEST(PairCorrelator, AConstantSignalCorrelatesWithNothing) {
  Rng rng(3);
  const MarkerCandidates a = RandomTrial(rng, 3);
  MarkerCandidates still = RandomTrial(rng, 3);
  still.signal.setConstant(0.37);
  const CorrelatedTrial ready_a(a);
  const CorrelatedTrial ready_still(still);
  PairCorrelator pair(ready_a, ready_still, kPoints, 1);
  const Subset subset = {0, 2};
  EXPECT_EQ(pair.Correlate(subset, subset), 0);
  EXPECT_EQ(PairCorrelation(a, subset, still, subset, kPoints), 0);
}

TEST(Vote, PicksWhatExhaustionPicksInThousandsOfCases) {
  Rng rng(4);
  for (int round = 0; round < 2000; ++round) {
    const Case c = RandomCase(rng, 4, 4);
    const auto votes = VotesByExhaustion(c);
    const MarkerChoice choice = ChooseByVote(c.trials, {.points = kPoints});
    EXPECT_TRUE(choice.warnings.empty());
    for (std::size_t i = 0; i < c.trials.size(); ++i) {
      const auto found = std::find(c.subsets[i].begin(), c.subsets[i].end(), choice.chosen[i]);
      ASSERT_NE(found, c.subsets[i].end());
      const double mine = votes[i][static_cast<std::size_t>(found - c.subsets[i].begin())];
      EXPECT_NEAR(mine, *std::max_element(votes[i].begin(), votes[i].end()), 1e-8)
          << "round " << round << " trial " << i;
    }
  }
}

TEST(Joint, ReachesTheExhaustedOptimumAndProvesItInThousandsOfCases) {
  Rng rng(5);
  for (int round = 0; round < 1500; ++round) {
    const Case c = RandomCase(rng, 4, 4);
    double best = -1e300;
    std::vector<std::size_t> at(c.trials.size(), 0);
    for (bool more = true; more;) {
      double sum = 0;
      for (std::size_t i = 0; i < at.size(); ++i) {
        for (std::size_t j = i + 1; j < at.size(); ++j) {
          sum += PairCorrelation(c.trials[i], c.subsets[i][at[i]], c.trials[j], c.subsets[j][at[j]],
                                 kPoints);
        }
      }
      best = std::max(best, sum);
      more = false;
      for (std::size_t i = 0; i < at.size() && !more; ++i) {
        more = ++at[i] < c.subsets[i].size();
        if (!more) at[i] = 0;
      }
    }
    const MarkerChoice choice = ChooseJointly(c.trials, {.points = kPoints});
    EXPECT_NEAR(choice.value, best, 1e-9) << "round " << round;
    EXPECT_NEAR(choice.gap(), 0, 1e-8);
    EXPECT_NEAR(SumOfCorrelations(c.trials, choice.chosen, kPoints), choice.value, 1e-9);
  }
}

TEST(Joint, IsNeverBehindTheVoteInItsOwnObjective) {
  Rng rng(6);
  for (int round = 0; round < 200; ++round) {
    const Case c = RandomCase(rng, 6, 6);
    const MarkerChoice joint = ChooseJointly(c.trials, {.points = kPoints});
    const MarkerChoice vote = ChooseByVote(c.trials, {.points = kPoints});
    EXPECT_GE(joint.value, SumOfCorrelations(c.trials, vote.chosen, kPoints) - 1e-9);
  }
}

TEST(MarkerChoice, TooManySubsetsLoseTheLeastCandidatesAndSaySo) {
  Rng rng(7);
  std::vector<MarkerCandidates> trials;
  for (int i = 0; i < 4; ++i) trials.push_back(RandomTrial(rng, 9));
  trials.push_back(RandomTrial(rng, 3));
  const MarkerChoiceOptions few = {.points = kPoints, .max_subset_pairs = 2000};
  const MarkerChoice vote = ChooseByVote(trials, few);
  ASSERT_EQ(vote.warnings.size(), 1u);
  EXPECT_THAT(vote.warnings[0], HasSubstr("trial " + trials[0].id + " ("));
  EXPECT_THAT(vote.warnings[0], HasSubstr(" of 9)"));
  const auto weakest = std::min_element(trials[0].score.begin(), trials[0].score.end());
  EXPECT_THAT(vote.chosen[0],
              ::testing::Not(::testing::Contains(weakest - trials[0].score.begin())));

  // The bound holds for the candidates that were left out, too.
  const MarkerChoice joint = ChooseJointly(trials, few);
  const MarkerChoice whole = ChooseJointly(trials, {.points = kPoints, .max_subset_pairs = 1e6});
  EXPECT_TRUE(whole.warnings.empty());
  EXPECT_LE(joint.value, whole.value + 1e-9);
  EXPECT_GE(joint.bound, whole.value - 1e-9);
}

TEST(MarkerChoice, EqualSubsetsGoToTheLargerLeastGapThenToTheEarlier) {
  MarkerCandidates still;
  still.id = "still";
  still.duration_s = 10;
  still.time_s = {1, 2, 5, 8};
  still.score = {1, 1, 1, 1};
  still.signal = Eigen::VectorXd::Zero(50);
  MarkerCandidates other = still;
  other.time_s = {3, 6};
  other.score = {1, 1};
  const std::vector<MarkerCandidates> trials = {still, other};
  EXPECT_THAT(ChooseByVote(trials).chosen[0], ElementsAre(0, 3));
  other.time_s = {3};
  other.score = {1};
  const std::vector<MarkerCandidates> single = {still, other};
  EXPECT_THAT(ChooseByVote(single).chosen[0], ElementsAre(0));
}

TEST(MarkerChoice, WithoutCandidatesNothingIsChosen) {
  Rng rng(8);
  std::vector<MarkerCandidates> trials = {RandomTrial(rng, 3), RandomTrial(rng, 2)};
  trials[1].time_s.clear();
  trials[1].score.clear();
  for (const MarkerChoice& choice : {ChooseByVote(trials), ChooseJointly(trials)}) {
    EXPECT_THAT(choice.chosen, ElementsAre(Subset{}, Subset{}));
  }
  EXPECT_TRUE(ChooseByVote({}).chosen.empty());
  EXPECT_TRUE(ChooseJointly({}).chosen.empty());
}

TEST(MarkerChoice, OneTrialKeepsAllItsMarkers) {
  Rng rng(9);
  const std::vector<MarkerCandidates> trials = {RandomTrial(rng, 5)};
  EXPECT_THAT(ChooseByVote(trials).chosen[0], ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(ChooseJointly(trials).chosen[0], ElementsAre(0, 1, 2, 3, 4));
}

}  // namespace
}  // namespace exemplar::learning
