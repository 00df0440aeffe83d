#include <algorithm>
#include <memory>
#include <numeric>

#include "exemplar/learning/marker_choice.hpp"
#include "joint_search.hpp"
#include "pair_correlator.hpp"
#include "subsets.hpp"

namespace exemplar::learning {
namespace {

// Candidates that the shortlist left out come back here: one marker of one trial at a time moves to
// another candidate, while the sum of correlations grows.
class Refinement {
 public:
  Refinement(const std::vector<CorrelatedTrial>& trials, int points) : trials_(trials) {
    constexpr double kRemember = 1000;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      for (std::size_t j = i + 1; j < trials.size(); ++j) {
        pairs_.emplace_back(trials[i], trials[j], points, kRemember);
      }
    }
  }

  void Run(std::vector<Subset>& chosen, long long max_correlations) {
    for (bool gained = true; gained && correlations_ < max_correlations;) {
      gained = false;
      for (std::size_t i = 0; i < trials_.size() && correlations_ < max_correlations; ++i) {
        if (MoveOne(chosen, i)) gained = true;
      }
    }
  }

  double Sum(const std::vector<Subset>& chosen) {
    double sum = 0;
    for (std::size_t i = 0; i < chosen.size(); ++i) sum += Value(chosen, i, chosen[i]);
    return sum / 2;
  }

 private:
  double Value(const std::vector<Subset>& chosen, std::size_t i, const Subset& subset) {
    double sum = 0;
    const std::size_t n = trials_.size();
    for (std::size_t j = 0; j < n; ++j) {
      if (j == i) continue;
      const std::size_t low = std::min(i, j);
      const std::size_t high = std::max(i, j);
      PairCorrelator& pair = pairs_[low * (2 * n - low - 1) / 2 + high - low - 1];
      sum += i < j ? pair.Correlate(subset, chosen[j]) : pair.Correlate(chosen[j], subset);
      ++correlations_;
    }
    return sum;
  }

  bool MoveOne(std::vector<Subset>& chosen, std::size_t i) {
    constexpr double kGain = 1e-9;
    const auto candidates = static_cast<int>(trials_[i].time_s.size());
    Subset best = chosen[i];
    const double before = Value(chosen, i, best);
    double most = before;
    for (std::size_t m = 0; m < chosen[i].size(); ++m) {
      for (int candidate = 0; candidate < candidates; ++candidate) {
        Subset moved = chosen[i];
        if (std::binary_search(moved.begin(), moved.end(), candidate)) continue;
        moved[m] = candidate;
        std::sort(moved.begin(), moved.end());
        const double value = Value(chosen, i, moved);
        if (value > most + kGain) {
          most = value;
          best = std::move(moved);
        }
      }
    }
    chosen[i] = std::move(best);
    return most > before;
  }

  const std::vector<CorrelatedTrial>& trials_;
  std::vector<PairCorrelator> pairs_;  // i < j, in order
  long long correlations_ = 0;
};

MarkerChoice ChooseTogether(std::span<const MarkerCandidates> trials,
                            const MarkerChoiceOptions& options) {
  MarkerChoice choice;
  const std::size_t n = trials.size();
  choice.chosen.resize(n);
  Shortlist list = MakeShortlist(trials, options.max_subset_pairs);
  choice.warnings = std::move(list.warnings);
  if (n == 0 || list.size == 0) return choice;

  const std::vector<CorrelatedTrial> correlated(trials.begin(), trials.end());
  std::vector<std::vector<Subset>> subsets;
  std::vector<std::size_t> labels;
  for (std::size_t i = 0; i < n; ++i) {
    subsets.push_back(AllSubsets(list.kept[i], list.size));
    labels.push_back(subsets.back().size());
  }
  PairwiseWorth worth(labels);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      PairCorrelator(correlated[i], correlated[j], options.points,
                     static_cast<double>(labels[i] * labels[j]))
          .CorrelateAll(list.kept[i], list.kept[j], list.size,
                        [&](std::size_t a, std::size_t b, double r) { worth.At(i, a, j, b) = r; });
    }
  }
  const JointOptimum optimum = MaximiseJointly(worth, options.max_search_steps);
  for (std::size_t i = 0; i < n; ++i) choice.chosen[i] = subsets[i][optimum.chosen[i]];
  choice.value = optimum.value;
  choice.bound = optimum.bound;
  if (list.complete) return choice;

  constexpr std::size_t kMostRefined = 64;  // trials: each pair of them keeps a memory
  if (n <= kMostRefined) {
    Refinement refinement(correlated, options.points);
    refinement.Run(choice.chosen, static_cast<long long>(options.max_subset_pairs / 2));
    choice.value = refinement.Sum(choice.chosen);
  }
  // Of all candidates: where both trials kept theirs, their best pair; else r is at most 1.
  choice.bound = 0;
  const auto all = [&](std::size_t i) { return list.kept[i].size() == trials[i].time_s.size(); };
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      choice.bound += all(i) && all(j) ? worth.Largest(i, j) : 1;
    }
  }
  return choice;
}

// Trials that are chosen for together; beyond, each of the others joins an even choice of them.
constexpr std::size_t kMostTogether = 100;
constexpr std::size_t kCore = 50;
constexpr double kMostSubsets = 120;  // of a trial that joins

std::vector<std::size_t> CoreOf(std::span<const MarkerCandidates> trials) {
  const auto fewest = std::min_element(trials.begin(), trials.end(),
                                       [](const MarkerCandidates& a, const MarkerCandidates& b) {
                                         return a.time_s.size() < b.time_s.size();
                                       });
  const auto least = static_cast<std::size_t>(fewest - trials.begin());
  std::vector<std::size_t> core;
  for (std::size_t k = 0; k < kCore; ++k) core.push_back(k * trials.size() / kCore);
  // The trial that decides how many markers there are is one of them.
  if (!std::binary_search(core.begin(), core.end(), least)) {
    *std::lower_bound(core.begin(), core.end() - 1, least) = least;
  }
  return core;
}

// The candidates of greatest score, so few that their subsets are.
std::vector<int> Clearest(const MarkerCandidates& trial, std::size_t size) {
  std::vector<int> kept(trial.time_s.size());
  std::iota(kept.begin(), kept.end(), 0);
  while (kept.size() > size && Binomial(kept.size(), size) > kMostSubsets) {
    kept.erase(std::min_element(kept.begin(), kept.end(), [&](int a, int b) {
      return trial.score[static_cast<std::size_t>(a)] < trial.score[static_cast<std::size_t>(b)];
    }));
  }
  return kept;
}

MarkerChoice ChooseByCore(std::span<const MarkerCandidates> trials,
                          const MarkerChoiceOptions& options) {
  const std::size_t n = trials.size();
  const std::vector<std::size_t> core = CoreOf(trials);
  std::vector<MarkerCandidates> core_trials;
  for (const std::size_t i : core) core_trials.push_back(trials[i]);
  const MarkerChoice of_core = ChooseTogether(core_trials, options);
  MarkerChoice choice;
  choice.warnings = of_core.warnings;
  choice.chosen.resize(n);
  const std::size_t size = of_core.chosen.front().size();
  if (size == 0) return choice;
  const std::vector<CorrelatedTrial> correlated(trials.begin(), trials.end());
  for (std::size_t k = 0; k < core.size(); ++k) choice.chosen[core[k]] = of_core.chosen[k];
  for (std::size_t i = 0; i < n; ++i) {
    if (!choice.chosen[i].empty()) continue;
    const std::vector<Subset> subsets = AllSubsets(Clearest(trials[i], size), size);
    std::vector<double> sums(subsets.size(), 0);
    for (std::size_t k = 0; k < core.size() && subsets.size() > 1; ++k) {
      PairCorrelator pair(correlated[i], correlated[core[k]], options.points, 1);
      for (std::size_t s = 0; s < subsets.size(); ++s) {
        sums[s] += pair.Correlate(subsets[s], of_core.chosen[k]);
      }
    }
    choice.chosen[i] = subsets[static_cast<std::size_t>(std::max_element(sums.begin(), sums.end()) -
                                                        sums.begin())];
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      choice.value += PairCorrelator(correlated[i], correlated[j], options.points, 1)
                          .Correlate(choice.chosen[i], choice.chosen[j]);
    }
  }
  // No r exceeds 1.
  const auto pairs = [](std::size_t count) { return static_cast<double>(count * (count - 1) / 2); };
  choice.bound = of_core.bound + pairs(n) - pairs(core.size());
  return choice;
}

}  // namespace

MarkerChoice ChooseJointly(std::span<const MarkerCandidates> trials,
                           const MarkerChoiceOptions& options) {
  return trials.size() > kMostTogether ? ChooseByCore(trials, options)
                                       : ChooseTogether(trials, options);
}

}  // namespace exemplar::learning
