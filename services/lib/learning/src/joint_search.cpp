#include "joint_search.hpp"

#include <algorithm>
#include <cassert>
#include <limits>
#include <numeric>

namespace exemplar::learning {
namespace {

constexpr double kTolerance = 1e-10;  // of a sum of correlations

using Labels = std::vector<std::size_t>;

// The worth of a choice is shares of its labels plus rests of their pairs; sharing out leaves that
// sum as it is and makes the largest values of its terms add up to less.
struct SharedWorth {
  std::vector<std::vector<double>> share;  // [variable][label]
  PairwiseWorth rest;

  explicit SharedWorth(const PairwiseWorth& worth) : rest(worth) {
    for (std::size_t i = 0; i < worth.variables(); ++i) share.emplace_back(worth.labels(i), 0.0);
  }

  // One step of MPLP: the pair takes its variables' shares and gives each half of the best that its
  // label can reach. The bound never rises.
  void ShareOut(std::size_t i, std::size_t j) {
    const std::size_t ni = rest.labels(i);
    const std::size_t nj = rest.labels(j);
    std::vector<double> best_i(ni, -std::numeric_limits<double>::infinity());
    std::vector<double> best_j(nj, -std::numeric_limits<double>::infinity());
    for (std::size_t a = 0; a < ni; ++a) {
      for (std::size_t b = 0; b < nj; ++b) {
        const double sum = rest.At(i, a, j, b) + share[i][a] + share[j][b];
        best_i[a] = std::max(best_i[a], sum);
        best_j[b] = std::max(best_j[b], sum);
      }
    }
    for (std::size_t a = 0; a < ni; ++a) {
      for (std::size_t b = 0; b < nj; ++b) {
        rest.At(i, a, j, b) += share[i][a] + share[j][b] - (best_i[a] + best_j[b]) / 2;
      }
    }
    for (std::size_t a = 0; a < ni; ++a) share[i][a] = best_i[a] / 2;
    for (std::size_t b = 0; b < nj; ++b) share[j][b] = best_j[b] / 2;
  }

  double Bound() const {
    double bound = 0;
    for (std::size_t i = 0; i < share.size(); ++i) {
      bound += *std::max_element(share[i].begin(), share[i].end());
      for (std::size_t j = i + 1; j < share.size(); ++j) bound += rest.Largest(i, j);
    }
    return bound;
  }
};

// Changes one variable at a time to its best label until none gains.
void Ascend(const PairwiseWorth& worth, Labels& chosen) {
  for (bool gained = true; gained;) {
    gained = false;
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      const auto value = [&](std::size_t a) {
        double sum = 0;
        for (std::size_t j = 0; j < chosen.size(); ++j) {
          if (j != i) sum += worth.At(i, a, j, chosen[j]);
        }
        return sum;
      };
      double best = value(chosen[i]);
      for (std::size_t a = 0; a < worth.labels(i); ++a) {
        const double now = value(a);
        if (now > best + kTolerance) {
          best = now;
          chosen[i] = a;
          gained = true;
        }
      }
    }
  }
}

class BranchAndBound {
 public:
  BranchAndBound(const SharedWorth& shared, JointOptimum& best, double max_steps)
      : shared_(shared), best_(best), max_steps_(max_steps), order_(shared.share.size()) {
    const std::size_t n = order_.size();
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::stable_sort(order_.begin(), order_.end(), [&](std::size_t i, std::size_t j) {
      return shared_.share[i].size() < shared_.share[j].size();
    });
    // What pairs of still open variables can add at most.
    open_pairs_.assign(n + 1, 0);
    for (std::size_t d = n; d-- > 0;) {
      open_pairs_[d] = open_pairs_[d + 1];
      for (std::size_t e = d + 1; e < n; ++e) {
        open_pairs_[d] +=
            shared_.rest.Largest(std::min(order_[d], order_[e]), std::max(order_[d], order_[e]));
      }
    }
    path_.assign(n, 0);
    reach_.assign(n + 1, shared_.share);
  }

  // Returns what no choice can exceed.
  double Run() {
    open_bound_ = best_.value;
    Open(0, 0);
    return open_bound_;
  }

 private:
  struct Child {
    std::size_t label;
    double bound;
  };

  // `fixed`: worth of the labels chosen at depths below `depth`, with the pairs among them.
  // reach_[depth][j][b]: share of label b of an open variable, with its pairs to the chosen ones.
  void Open(std::size_t depth, double fixed) {
    const std::size_t n = order_.size();
    if (depth == n) {
      // Summed again from the worths themselves by the caller; here it only has to be ahead.
      if (fixed > best_.value + kTolerance) {
        best_.value = fixed;
        best_.chosen = path_;
        open_bound_ = std::max(open_bound_, fixed);
      }
      return;
    }
    const std::size_t i = order_[depth];
    const std::vector<std::vector<double>>& reach = reach_[depth];
    std::vector<std::vector<double>>& next = reach_[depth + 1];
    std::vector<Child> children;
    for (std::size_t a = 0; a < reach[i].size(); ++a) {
      double bound = fixed + reach[i][a] + open_pairs_[depth + 1];
      for (std::size_t e = depth + 1; e < n; ++e) {
        const std::size_t j = order_[e];
        double most = -std::numeric_limits<double>::infinity();
        steps_ += static_cast<double>(reach[j].size());
        for (std::size_t b = 0; b < reach[j].size(); ++b) {
          most = std::max(most, reach[j][b] + shared_.rest.At(i, a, j, b));
        }
        bound += most;
      }
      if (bound > best_.value + kTolerance) children.push_back({a, bound});
    }
    std::stable_sort(children.begin(), children.end(),
                     [](const Child& a, const Child& b) { return a.bound > b.bound; });
    for (const Child& child : children) {
      if (child.bound <= best_.value + kTolerance) return;
      if (steps_ >= max_steps_) {
        open_bound_ = std::max(open_bound_, child.bound);
        return;
      }
      path_[i] = child.label;
      for (std::size_t e = depth + 1; e < n; ++e) {
        const std::size_t j = order_[e];
        for (std::size_t b = 0; b < reach[j].size(); ++b) {
          next[j][b] = reach[j][b] + shared_.rest.At(i, child.label, j, b);
        }
      }
      Open(depth + 1, fixed + reach[i][child.label]);
    }
  }

  const SharedWorth& shared_;
  JointOptimum& best_;
  double max_steps_;
  double steps_ = 0;
  Labels order_;
  std::vector<double> open_pairs_;  // by depth
  Labels path_;                     // by variable
  std::vector<std::vector<std::vector<double>>> reach_;
  double open_bound_ = 0;
};

}  // namespace

PairwiseWorth::PairwiseWorth(std::vector<std::size_t> labels) : labels_(std::move(labels)) {
  const std::size_t n = labels_.size();
  start_.assign(n * n, 0);
  std::size_t size = 0;
  for (std::size_t i = 0; i < n; ++i) {
    assert(labels_[i] > 0);
    for (std::size_t j = i + 1; j < n; ++j) {
      start_[i * n + j] = size;
      size += labels_[i] * labels_[j];
    }
  }
  values_.assign(size, 0);
}

double PairwiseWorth::Sum(std::span<const std::size_t> chosen) const {
  double sum = 0;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    for (std::size_t j = i + 1; j < chosen.size(); ++j) sum += At(i, chosen[i], j, chosen[j]);
  }
  return sum;
}

double PairwiseWorth::Largest(std::size_t i, std::size_t j) const {
  const auto first = values_.begin() + static_cast<std::ptrdiff_t>(Index(i, 0, j, 0));
  return *std::max_element(first, first + static_cast<std::ptrdiff_t>(labels_[i] * labels_[j]));
}

JointOptimum MaximiseJointly(const PairwiseWorth& worth, double max_steps) {
  constexpr int kMostRounds = 60;
  constexpr double kLeastProgress = 1e-6;
  JointOptimum best;
  const std::size_t n = worth.variables();
  best.chosen.assign(n, 0);
  if (n < 2) return best;

  const auto consider = [&](Labels chosen) {
    Ascend(worth, chosen);
    const double value = worth.Sum(chosen);
    if (value > best.value + kTolerance) {
      best.value = value;
      best.chosen = std::move(chosen);
    }
  };
  best.value = worth.Sum(best.chosen);
  consider(best.chosen);
  SharedWorth shared(worth);
  double bound = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kMostRounds; ++round) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) shared.ShareOut(i, j);
    }
    Labels decoded(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::vector<double>& share = shared.share[i];
      decoded[i] =
          static_cast<std::size_t>(std::max_element(share.begin(), share.end()) - share.begin());
    }
    consider(std::move(decoded));
    const double now = shared.Bound();
    const bool slow = bound - now < kLeastProgress * (1 + std::abs(now));
    bound = now;
    if (slow || bound <= best.value + kTolerance) break;
  }
  if (bound > best.value + kTolerance) {
    bound = std::min(bound, BranchAndBound(shared, best, max_steps).Run());
  }
  best.value = worth.Sum(best.chosen);
  best.bound = std::max(bound, best.value);
  return best;
}

}  // namespace exemplar::learning
