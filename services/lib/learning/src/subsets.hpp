#pragma once
// Subsets of one size of each trial's candidates.

#include <span>
#include <string>
#include <vector>

#include "exemplar/learning/marker_choice.hpp"

namespace exemplar::learning {

using Subset = std::vector<int>;

/// C(n, k), rounded where it exceeds a double's whole numbers.
double Binomial(std::size_t n, std::size_t k);

/// All subsets of `size` of the ascending `candidates`, in lexicographic order.
std::vector<Subset> AllSubsets(const std::vector<int>& candidates, std::size_t size);

/// Candidates of each trial that take part, so that the pairs of subsets stay within a number.
struct Shortlist {
  std::size_t size = 0;                ///< N_min
  std::vector<std::vector<int>> kept;  ///< [trial]: ascending
  bool complete = true;                ///< nobody was left out
  std::vector<std::string> warnings;   ///< who lost candidates
};
Shortlist MakeShortlist(std::span<const MarkerCandidates> trials, double max_subset_pairs);

/// True when subset `b` is to be preferred to `a` at equal worth: by the larger least gap.
bool HasLargerLeastGap(const MarkerCandidates& trial, const Subset& b, const Subset& a);

}  // namespace exemplar::learning
