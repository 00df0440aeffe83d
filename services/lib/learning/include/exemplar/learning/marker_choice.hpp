#pragma once
// Which of each trial's candidate markers mean the same (PAPER.md section 4).

#include <Eigen/Core>
#include <functional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::learning {

/// What the choice needs to know of a trial.
struct MarkerCandidates {
  std::string id;
  std::vector<double> time_s;  ///< strictly increasing, strictly inside (0, duration_s)
  std::vector<double> score;   ///< one a candidate; only to thin out when there are too many
  double duration_s = 0;
  Eigen::VectorXd signal;  ///< evenly spaced over [0, duration_s]; what is correlated
};

/// One subset of candidates for each trial.
struct MarkerChoice {
  std::vector<std::vector<int>> chosen;  ///< [trial]: indices of its candidates, ascending
  std::vector<std::string> warnings;     ///< candidates left out to stay within the budget
  long long subset_pairs = 0;            ///< pairs of subsets that the rule speaks of
};

struct MarkerChoiceOptions {
  int points = 240;                      ///< of the grid on which two trials are correlated
  long long max_subset_pairs = 2000000;  ///< above it, candidates are thinned out by score
};

/// Pearson's r of two trials, each warped so that its m-th marker falls on the mean of both (steps
/// 3 of PAPER.md section 4). `a_subset` and `b_subset` are of one size.
double PairCorrelation(const MarkerCandidates& a, std::span<const int> a_subset,
                       const MarkerCandidates& b, std::span<const int> b_subset, int points);

/// The paper's rule: in each trial the subset whose correlations, summed over all subsets of all
/// other trials, are largest.
MarkerChoice ChooseByVote(std::span<const MarkerCandidates> trials,
                          const MarkerChoiceOptions& options = {});

}  // namespace exemplar::learning
