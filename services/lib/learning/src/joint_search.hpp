#pragma once
// Which label each variable takes so that a sum of pairwise terms is largest: exact where the
// search ends within its nodes, and always with a proven bound.

#include <span>
#include <vector>

namespace exemplar::learning {

/// worth(i, a, j, b) for i < j, dense.
class PairwiseWorth {
 public:
  explicit PairwiseWorth(std::vector<std::size_t> labels);
  std::size_t variables() const { return labels_.size(); }
  std::size_t labels(std::size_t i) const { return labels_[i]; }
  double& At(std::size_t i, std::size_t a, std::size_t j, std::size_t b) {
    return values_[Index(i, a, j, b)];
  }
  double At(std::size_t i, std::size_t a, std::size_t j, std::size_t b) const {
    return i < j ? values_[Index(i, a, j, b)] : values_[Index(j, b, i, a)];
  }
  double Sum(std::span<const std::size_t> chosen) const;
  /// Largest worth of two variables, i < j.
  double Largest(std::size_t i, std::size_t j) const;

 private:
  std::size_t Index(std::size_t i, std::size_t a, std::size_t j, std::size_t b) const {
    return start_[i * labels_.size() + j] + a * labels_[j] + b;
  }
  std::vector<std::size_t> labels_;
  std::vector<std::size_t> start_;  // by pair
  std::vector<double> values_;
};

struct JointOptimum {
  std::vector<std::size_t> chosen;
  double value = 0;
  double bound = 0;  ///< equals `value` where the search ended
};

/// Maximises worth.Sum(chosen). The bound comes from dual decomposition (MPLP: each pair's worth is
/// shared out to its variables, Globerson & Jaakkola 2007); branch and bound closes what it leaves
/// open, within `max_steps` look-ups of pairs. Precondition: every variable has a label.
JointOptimum MaximiseJointly(const PairwiseWorth& worth, double max_steps);

}  // namespace exemplar::learning
