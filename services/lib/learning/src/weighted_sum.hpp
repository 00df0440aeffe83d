#pragma once
// The sums that a query spends its time on. They use the processor's wide registers where it has
// them; results agree to rounding.

#include <Eigen/Core>
#include <vector>

namespace exemplar::learning {

/// Columns of numbers, laid out so that a weighted sum of them reads memory once and in order.
/// Immutable, so thread-safe.
class Streams {
 public:
  Streams() = default;
  explicit Streams(const Eigen::Ref<const Eigen::MatrixXd>& columns);

  Eigen::Index rows() const { return rows_; }
  Eigen::Index count() const { return count_; }

  /// columns * weights.
  Eigen::VectorXd Sum(const Eigen::Ref<const Eigen::VectorXd>& weights) const;
  /// columns * weights, for count x 3 weights.
  Eigen::MatrixX3d Sum3(const Eigen::Ref<const Eigen::MatrixX3d>& weights) const;

 private:
  Eigen::Index rows_ = 0;
  Eigen::Index count_ = 0;
  struct alignas(64) Tile {
    double values[8] = {};
  };
  std::vector<Tile> tiles_;  // eight rows of each column in turn, then the next eight rows
};

}  // namespace exemplar::learning
