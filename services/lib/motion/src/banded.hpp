#pragma once
// Symmetric positive definite systems with a band: the normal equations of a path.

#include <Eigen/Core>
#include <cassert>
#include <cmath>
#include <vector>

namespace exemplar::motion {

/// The lower band of a symmetric matrix, column by column.
class BandedMatrix {
 public:
  /// `half_band`: entries (i, j) with |i - j| <= half_band may differ from zero.
  BandedMatrix(int size, int half_band)
      : size_(size),
        stride_(half_band + 1),
        data_(static_cast<std::size_t>(size) * static_cast<std::size_t>(stride_), 0.0) {}

  int size() const { return size_; }
  void SetZero() { std::fill(data_.begin(), data_.end(), 0.0); }
  /// Precondition: row >= column, row - column <= half_band.
  double& operator()(int row, int column) { return data_[Index(row, column)]; }

  /// Overwrites the matrix by its Cholesky factor; false when it is not positive definite.
  bool Factorise() {
    for (int j = 0; j < size_; ++j) {
      double* column = &data_[Index(j, j)];
      if (!(column[0] > 0) || !std::isfinite(column[0])) return false;
      const double pivot = std::sqrt(column[0]);
      const int below = std::min(stride_ - 1, size_ - 1 - j);
      column[0] = pivot;
      for (int k = 1; k <= below; ++k) column[k] /= pivot;
      for (int k = 1; k <= below; ++k) {
        if (column[k] == 0) continue;
        double* target = &data_[Index(j + k, j + k)];
        for (int m = k; m <= below; ++m) target[m - k] -= column[k] * column[m];
      }
    }
    return true;
  }

  /// Solves in place with the factor. Precondition: Factorise() returned true.
  void Solve(Eigen::Ref<Eigen::VectorXd> x) const {
    assert(x.size() == size_);
    for (int j = 0; j < size_; ++j) {
      const double* column = &data_[Index(j, j)];
      const int below = std::min(stride_ - 1, size_ - 1 - j);
      x[j] /= column[0];
      for (int k = 1; k <= below; ++k) x[j + k] -= column[k] * x[j];
    }
    for (int j = size_ - 1; j >= 0; --j) {
      const double* column = &data_[Index(j, j)];
      const int below = std::min(stride_ - 1, size_ - 1 - j);
      for (int k = 1; k <= below; ++k) x[j] -= column[k] * x[j + k];
      x[j] /= column[0];
    }
  }

 private:
  std::size_t Index(int row, int column) const {
    assert(row >= column && row - column < stride_);
    return static_cast<std::size_t>(column) * static_cast<std::size_t>(stride_) +
           static_cast<std::size_t>(row - column);
  }

  int size_;
  int stride_;
  std::vector<double> data_;
};

}  // namespace exemplar::motion
