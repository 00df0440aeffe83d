#include "subsets.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "exemplar/base/text.hpp"

namespace exemplar::learning {
namespace {

double SubsetPairs(const Shortlist& list) {
  double sum = 0, squares = 0;
  for (const std::vector<int>& kept : list.kept) {
    const double subsets = Binomial(kept.size(), list.size);
    sum += subsets;
    squares += subsets * subsets;
  }
  return (sum * sum - squares) / 2;
}

std::string Describe(std::span<const MarkerCandidates> trials, const Shortlist& list) {
  constexpr std::size_t kMostNamed = 5;
  std::vector<std::string> cut;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const std::size_t all = trials[i].time_s.size();
    if (list.kept[i].size() == all) continue;
    cut.push_back("trial " + trials[i].id + " (" + std::to_string(list.kept[i].size()) + " of " +
                  std::to_string(all) + ")");
  }
  const std::size_t more = cut.size() - std::min(cut.size(), kMostNamed);
  cut.resize(cut.size() - more);
  return "to bound the work only the clearest candidate markers took part in the choice: " +
         Join(cut, ", ") + (more > 0 ? " and " + std::to_string(more) + " trials more" : "");
}

double LeastGap(const MarkerCandidates& trial, const Subset& subset) {
  double least = trial.duration_s;
  for (std::size_t m = 1; m < subset.size(); ++m) {
    least = std::min(least, trial.time_s[static_cast<std::size_t>(subset[m])] -
                                trial.time_s[static_cast<std::size_t>(subset[m - 1])]);
  }
  return least;
}

}  // namespace

double Binomial(std::size_t n, std::size_t k) {
  if (k > n) return 0;
  double result = 1;
  for (std::size_t i = 1; i <= k; ++i) {
    result = result * static_cast<double>(n - k + i) / static_cast<double>(i);
  }
  return std::round(result);
}

std::vector<Subset> AllSubsets(const std::vector<int>& candidates, std::size_t size) {
  std::vector<Subset> subsets;
  const std::size_t n = candidates.size();
  if (size > n) return subsets;
  std::vector<std::size_t> place(size);
  std::iota(place.begin(), place.end(), std::size_t{0});
  for (;;) {
    Subset subset(size);
    for (std::size_t m = 0; m < size; ++m) subset[m] = candidates[place[m]];
    subsets.push_back(std::move(subset));
    std::size_t moving = size;
    while (moving > 0 && place[moving - 1] == n - size + moving - 1) --moving;
    if (moving == 0) return subsets;
    std::iota(place.begin() + static_cast<std::ptrdiff_t>(moving) - 1, place.end(),
              place[moving - 1] + 1);
  }
}

Shortlist MakeShortlist(std::span<const MarkerCandidates> trials, double max_subset_pairs) {
  Shortlist list;
  for (const MarkerCandidates& trial : trials) {
    list.size = list.kept.empty() ? trial.time_s.size() : std::min(list.size, trial.time_s.size());
    list.kept.emplace_back(trial.time_s.size());
    std::iota(list.kept.back().begin(), list.kept.back().end(), 0);
  }
  // Each round takes the least candidate of the longest list.
  while (SubsetPairs(list) > max_subset_pairs) {
    const auto longest =
        std::max_element(list.kept.begin(), list.kept.end(),
                         [](const auto& a, const auto& b) { return a.size() < b.size(); });
    if (longest->size() == list.size) break;
    const std::vector<double>& score =
        trials[static_cast<std::size_t>(longest - list.kept.begin())].score;
    longest->erase(std::min_element(longest->begin(), longest->end(), [&](int a, int b) {
      return score[static_cast<std::size_t>(a)] < score[static_cast<std::size_t>(b)];
    }));
    list.complete = false;
  }
  if (!list.complete) list.warnings.push_back(Describe(trials, list));
  return list;
}

bool HasLargerLeastGap(const MarkerCandidates& trial, const Subset& b, const Subset& a) {
  return LeastGap(trial, b) > LeastGap(trial, a);
}

}  // namespace exemplar::learning
