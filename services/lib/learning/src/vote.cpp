#include <algorithm>
#include <cmath>

#include "exemplar/learning/marker_choice.hpp"
#include "pair_correlator.hpp"
#include "subsets.hpp"

namespace exemplar::learning {

MarkerChoice ChooseByVote(std::span<const MarkerCandidates> trials,
                          const MarkerChoiceOptions& options) {
  constexpr double kTie = 1e-9;
  MarkerChoice choice;
  const std::size_t n = trials.size();
  choice.chosen.resize(n);
  Shortlist list = MakeShortlist(trials, options.max_subset_pairs);
  choice.warnings = std::move(list.warnings);

  std::vector<std::vector<Subset>> subsets(n);
  std::vector<std::vector<double>> votes(n);
  for (std::size_t i = 0; i < n; ++i) {
    subsets[i] = AllSubsets(list.kept[i], list.size);
    votes[i].assign(subsets[i].size(), 0);
  }
  const std::vector<CorrelatedTrial> correlated(trials.begin(), trials.end());
  for (std::size_t i = 0; list.size > 0 && i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      const auto pairs = static_cast<double>(subsets[i].size() * subsets[j].size());
      PairCorrelator(correlated[i], correlated[j], options.points, pairs)
          .CorrelateAll(list.kept[i], list.kept[j], list.size,
                        [&](std::size_t a, std::size_t b, double r) {
                          votes[i][a] += r;
                          votes[j][b] += r;
                        });
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t best = 0;
    for (std::size_t s = 1; s < subsets[i].size(); ++s) {
      const double lead = votes[i][s] - votes[i][best];
      const double tie = kTie * (1 + std::abs(votes[i][best]));
      if (lead > tie ||
          (lead > -tie && HasLargerLeastGap(trials[i], subsets[i][s], subsets[i][best]))) {
        best = s;
      }
    }
    choice.chosen[i] = subsets[i][best];
  }
  return choice;
}

}  // namespace exemplar::learning
