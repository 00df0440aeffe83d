#include "exemplar/learning/marker_choice.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "exemplar/learning/hermite.hpp"

namespace exemplar::learning {
namespace {

using Subset = std::vector<int>;

// C(n, k) as a double: it may be astronomic.
double Binomial(std::size_t n, std::size_t k) {
  double result = 1;
  for (std::size_t i = 1; i <= k; ++i) {
    result = result * static_cast<double>(n - k + i) / static_cast<double>(i);
  }
  return std::round(result);
}

std::vector<Subset> AllSubsets(const std::vector<int>& kept, std::size_t size) {
  std::vector<Subset> subsets;
  Subset places(size);
  std::iota(places.begin(), places.end(), 0);
  const auto n = static_cast<int>(kept.size());
  for (;;) {
    Subset subset;
    for (const int place : places) subset.push_back(kept[static_cast<std::size_t>(place)]);
    subsets.push_back(std::move(subset));
    int at = static_cast<int>(size) - 1;
    while (at >= 0 && places[static_cast<std::size_t>(at)] == n - static_cast<int>(size) + at) --at;
    if (at < 0) return subsets;
    int next = ++places[static_cast<std::size_t>(at)];
    for (auto i = static_cast<std::size_t>(at) + 1; i < size; ++i) places[i] = ++next;
  }
}

std::vector<double> Knots(const MarkerCandidates& trial, std::span<const int> subset) {
  std::vector<double> knots = {0};
  for (const int m : subset) knots.push_back(trial.time_s[static_cast<std::size_t>(m)]);
  knots.push_back(trial.duration_s);
  return knots;
}

double SignalAt(const MarkerCandidates& trial, double time_s) {
  const auto last = static_cast<double>(trial.signal.size() - 1);
  const double place = std::clamp(time_s / trial.duration_s * last, 0.0, last);
  const auto at = std::min(static_cast<Eigen::Index>(place), trial.signal.size() - 2);
  const double part = place - static_cast<double>(at);
  return (1 - part) * trial.signal[at] + part * trial.signal[at + 1];
}

// Between neighbouring markers; the trial's length for fewer than two.
double LeastGap(const MarkerCandidates& trial, std::span<const int> subset) {
  double least = trial.duration_s;
  for (std::size_t m = 1; m < subset.size(); ++m) {
    least = std::min(least, trial.time_s[static_cast<std::size_t>(subset[m])] -
                                trial.time_s[static_cast<std::size_t>(subset[m - 1])]);
  }
  return least;
}

}  // namespace

double PairCorrelation(const MarkerCandidates& a, std::span<const int> a_subset,
                       const MarkerCandidates& b, std::span<const int> b_subset, int points) {
  const std::vector<double> a_knots = Knots(a, a_subset);
  const std::vector<double> b_knots = Knots(b, b_subset);
  std::vector<double> mean(a_knots.size());
  for (std::size_t k = 0; k < mean.size(); ++k) mean[k] = (a_knots[k] + b_knots[k]) / 2;
  const MonotoneHermite a_warp(mean, a_knots);
  const MonotoneHermite b_warp(mean, b_knots);
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (int p = 0; p < points; ++p) {
    const double at = mean.back() * p / (points - 1);
    const double va = SignalAt(a, a_warp(at));
    const double vb = SignalAt(b, b_warp(at));
    sa += va;
    sb += vb;
    saa += va * va;
    sbb += vb * vb;
    sab += va * vb;
  }
  const double n = points;
  const double da = saa - sa * sa / n;
  const double db = sbb - sb * sb / n;
  if (!(da > 1e-12 * saa) || !(db > 1e-12 * sbb)) return 0;
  return std::clamp((sab - sa * sb / n) / std::sqrt(da * db), -1.0, 1.0);
}

MarkerChoice ChooseByVote(std::span<const MarkerCandidates> trials,
                          const MarkerChoiceOptions& options) {
  MarkerChoice choice;
  const std::size_t n = trials.size();
  choice.chosen.resize(n);
  if (n == 0) return choice;
  std::size_t size = trials[0].time_s.size();
  for (const MarkerCandidates& trial : trials) size = std::min(size, trial.time_s.size());
  if (size == 0) return choice;

  std::vector<std::vector<int>> kept(n);
  for (std::size_t i = 0; i < n; ++i) {
    kept[i].resize(trials[i].time_s.size());
    std::iota(kept[i].begin(), kept[i].end(), 0);
  }
  const auto pairs = [&] {
    double sum = 0, squares = 0;
    for (const auto& k : kept) {
      const double subsets = Binomial(k.size(), size);
      sum += subsets;
      squares += subsets * subsets;
    }
    return (sum * sum - squares) / 2;
  };
  while (pairs() > static_cast<double>(options.max_subset_pairs)) {
    const auto most = std::max_element(
        kept.begin(), kept.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
    if (most->size() == size) break;
    const MarkerCandidates& trial = trials[static_cast<std::size_t>(most - kept.begin())];
    most->erase(std::min_element(most->begin(), most->end(), [&](int a, int b) {
      return trial.score[static_cast<std::size_t>(a)] < trial.score[static_cast<std::size_t>(b)];
    }));
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (kept[i].size() == trials[i].time_s.size()) continue;
    choice.warnings.push_back("trial " + trials[i].id + ": only the " +
                              std::to_string(kept[i].size()) + " clearest of " +
                              std::to_string(trials[i].time_s.size()) +
                              " candidate markers took part, to bound the work");
  }
  choice.subset_pairs = static_cast<long long>(pairs());

  std::vector<std::vector<Subset>> subsets(n);
  std::vector<std::vector<double>> score(n);
  for (std::size_t i = 0; i < n; ++i) {
    subsets[i] = AllSubsets(kept[i], size);
    score[i].assign(subsets[i].size(), 0);
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      for (std::size_t a = 0; a < subsets[i].size(); ++a) {
        for (std::size_t b = 0; b < subsets[j].size(); ++b) {
          const double r =
              PairCorrelation(trials[i], subsets[i][a], trials[j], subsets[j][b], options.points);
          score[i][a] += r;
          score[j][b] += r;
        }
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t best = 0;
    for (std::size_t a = 1; a < subsets[i].size(); ++a) {
      const double ahead = score[i][a] - score[i][best];
      const double tie = 1e-9 * (1 + std::abs(score[i][best]));
      if (ahead > tie || (ahead > -tie && LeastGap(trials[i], subsets[i][a]) >
                                              LeastGap(trials[i], subsets[i][best]))) {
        best = a;
      }
    }
    choice.chosen[i] = subsets[i][best];
  }
  return choice;
}

}  // namespace exemplar::learning
