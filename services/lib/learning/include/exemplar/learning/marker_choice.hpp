#pragma once
// Which of each trial's candidate markers mean the same (PAPER.md section 4). Two rules with
// objectives of their own: the paper's vote, and the best joint choice.

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

namespace exemplar::learning {

/// What the choice needs to know of a trial.
struct MarkerCandidates {
  std::string id;
  std::vector<double> time_s;  ///< strictly increasing, strictly inside (0, duration_s)
  std::vector<double> score;   ///< one a candidate; only to thin them out when there are too many
  double duration_s = 0;       ///< positive
  Eigen::VectorXd signal;      ///< what is correlated, evenly spaced over [0, duration_s]; n >= 2
};

struct MarkerChoiceOptions {
  /// Of the grid over the mean of two trials' durations on which they are correlated.
  int points = 240;
  /// Correlations of two subsets that may be computed. Where a rule asks for more, the candidates
  /// of least score are left out, and `warnings` says so.
  double max_subset_pairs = 200000;
  /// Look-ups of correlations that the search for the joint choice may make.
  double max_search_steps = 1e8;
};

/// One subset of N_min candidates for each trial, N_min being the least number that a trial has.
struct MarkerChoice {
  std::vector<std::vector<int>> chosen;  ///< [trial]: indices of its candidates, ascending
  /// Of ChooseJointly: the sum of r over the pairs of trials with the chosen subsets, and what no
  /// choice can exceed.
  double value = 0;
  double bound = 0;
  std::vector<std::string> warnings;  ///< candidates left out

  double gap() const { return bound - value; }
};

/// Pearson's r of two trials, each warped so that its m-th marker falls on the mean of both (steps
/// 3 and 4). 0 where either series is constant. Precondition: subsets of one size, ascending.
double PairCorrelation(const MarkerCandidates& a, std::span<const int> a_subset,
                       const MarkerCandidates& b, std::span<const int> b_subset, int points);

/// Sum of r over all pairs of trials: what ChooseJointly maximises.
double SumOfCorrelations(std::span<const MarkerCandidates> trials,
                         std::span<const std::vector<int>> chosen, int points);

/// The paper's rule: in each trial the subset whose correlations, summed over all subsets of all
/// other trials, are largest. Ties go to the larger least gap between markers, then to the earlier.
/// Every subset is tried; warps of two trials are put together from stretches computed once.
MarkerChoice ChooseByVote(std::span<const MarkerCandidates> trials,
                          const MarkerChoiceOptions& options = {});

/// The best joint choice: one subset a trial so that the sum of r over the pairs of trials is
/// largest. Bounded by dual decomposition (MPLP, Globerson & Jaakkola 2007), closed by branch and
/// bound; `bound` is proven for all candidates, also those that were left out.
MarkerChoice ChooseJointly(std::span<const MarkerCandidates> trials,
                           const MarkerChoiceOptions& options = {});

}  // namespace exemplar::learning
