#pragma once
// The sums that a query spends its time on. They use the processor's wide registers where it has
// them; results agree to rounding.

#include <Eigen/Core>
#include <cstdint>
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
  /// The same, cut into a matrix of this shape column by column.
  Eigen::MatrixXd Sum(const Eigen::Ref<const Eigen::VectorXd>& weights, Eigen::Index rows,
                      Eigen::Index columns) const;
  /// columns * weights, for count x 3 weights.
  Eigen::MatrixX3d Sum3(const Eigen::Ref<const Eigen::MatrixX3d>& weights) const;

 private:
  void SumTo(const Eigen::Ref<const Eigen::VectorXd>& weights, double* sum) const;

  Eigen::Index rows_ = 0;
  Eigen::Index count_ = 0;
  struct alignas(64) Tile {
    double values[8] = {};
  };
  std::vector<Tile> tiles_;  // eight rows of each column in turn, then the next eight rows
};

/// The same in half the memory, which is what most of a sum's time goes to: the columns' mean, and
/// how far each is from it in 32 bits. A sum is off by at most 2^-32 of the greatest such distance
/// times the sum of the weights' magnitudes. Immutable, so thread-safe.
class RoundedStreams {
 public:
  RoundedStreams() = default;
  explicit RoundedStreams(const Eigen::Ref<const Eigen::MatrixXd>& columns);

  Eigen::Index rows() const { return rows_; }
  Eigen::Index count() const { return count_; }

  /// columns * weights, cut into a matrix of this shape column by column.
  Eigen::MatrixXd Sum(const Eigen::Ref<const Eigen::VectorXd>& weights, Eigen::Index rows,
                      Eigen::Index columns) const;

 private:
  Eigen::Index rows_ = 0;
  Eigen::Index count_ = 0;
  double step_ = 0;
  struct alignas(32) Tile {
    std::int32_t steps[8] = {};
  };
  std::vector<double> mean_;  // whole tiles
  std::vector<Tile> tiles_;   // as those of Streams
};

}  // namespace exemplar::learning
