#pragma once
// Symmetric positive definite systems with a band: the normal equations of a path.

#include <Eigen/Core>
#include <algorithm>
#include <cassert>
#include <vector>

namespace exemplar::motion {

/// The lower band of a symmetric matrix, column by column. After each column stand zeros, so that
/// four of its entries can be taken at a time.
class BandedMatrix {
 public:
  /// `half_band`: entries (i, j) with |i - j| <= half_band may differ from zero.
  BandedMatrix(int size, int half_band);

  int size() const { return size_; }
  int half_band() const { return half_band_; }
  void SetZero() { std::fill(data_.begin(), data_.end(), 0.0); }
  /// Precondition: row >= column, row - column <= half_band.
  double& operator()(int row, int column) { return data_[Index(row, column)]; }
  double operator()(int row, int column) const { return data_[Index(row, column)]; }

  /// Overwrites the matrix by its Cholesky factor; false when it is not positive definite.
  bool Factorise();
  /// Solves in place with the factor. Precondition: Factorise() returned true.
  void Solve(Eigen::Ref<Eigen::VectorXd> x) const;

 private:
  std::size_t Index(int row, int column) const {
    assert(row >= column && row - column <= half_band_);
    return static_cast<std::size_t>(column) * static_cast<std::size_t>(stride_) +
           static_cast<std::size_t>(row - column);
  }

  int size_;
  int half_band_;
  int stride_;  ///< from one column to the next
  std::vector<double> data_;
};

}  // namespace exemplar::motion
