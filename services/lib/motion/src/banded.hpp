#pragma once
// Symmetric positive definite systems with a band: the normal equations of a path.

#include <Eigen/Core>
#include <algorithm>
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
  int half_band() const { return stride_ - 1; }
  void SetZero() { std::fill(data_.begin(), data_.end(), 0.0); }
  /// Precondition: row >= column, row - column <= half_band.
  double& operator()(int row, int column) { return data_[Index(row, column)]; }
  double operator()(int row, int column) const { return data_[Index(row, column)]; }

  /// Overwrites the matrix by its Cholesky factor; false when it is not positive definite. Takes
  /// two columns at a time, which halves the passes over the rest.
  bool Factorise() {
    int j = 0;
    for (; j + 1 < size_; j += 2) {
      if (!Scale(j)) return false;
      double* first = &data_[Index(j, j)];
      const int below = std::min(stride_ - 1, size_ - 1 - j);
      if (below > 0) {
        Span(&data_[Index(j + 1, j + 1)], below).noalias() -=
            first[1] * ConstSpan(first + 1, below);
      }
      if (!Scale(j + 1)) return false;
      double* second = &data_[Index(j + 1, j + 1)];
      const int below_second = std::min(stride_ - 1, size_ - 2 - j);
      for (int k = 1; k <= below_second; ++k) {
        const double a = k + 1 <= below ? first[k + 1] : 0.0;
        const double b = second[k];
        if (a == 0 && b == 0) continue;
        const int both = below - k;  // rows that the first column reaches, too
        double* target = &data_[Index(j + 1 + k, j + 1 + k)];
        if (both > 0) {
          Span(target, both).noalias() -=
              a * ConstSpan(first + k + 1, both) + b * ConstSpan(second + k, both);
        }
        for (int row = std::max(0, both); row <= below_second - k; ++row) {
          target[row] -= b * second[k + row];
        }
      }
    }
    return j >= size_ || Scale(j);
  }

  /// Solves in place with the factor. Precondition: Factorise() returned true.
  void Solve(Eigen::Ref<Eigen::VectorXd> x) const {
    assert(x.size() == size_);
    for (int j = 0; j < size_; ++j) {
      const double* column = &data_[Index(j, j)];
      const int below = std::min(stride_ - 1, size_ - 1 - j);
      x[j] /= column[0];
      x.segment(j + 1, below).noalias() -= x[j] * ConstSpan(column + 1, below);
    }
    for (int j = size_ - 1; j >= 0; --j) {
      const double* column = &data_[Index(j, j)];
      const int below = std::min(stride_ - 1, size_ - 1 - j);
      x[j] = (x[j] - ConstSpan(column + 1, below).dot(x.segment(j + 1, below))) / column[0];
    }
  }

 private:
  using Span = Eigen::Map<Eigen::VectorXd>;
  using ConstSpan = Eigen::Map<const Eigen::VectorXd>;

  /// Divides a column by the root of its pivot.
  bool Scale(int j) {
    double* column = &data_[Index(j, j)];
    if (!(column[0] > 0) || !std::isfinite(column[0])) return false;
    column[0] = std::sqrt(column[0]);
    Span(column + 1, std::min(stride_ - 1, size_ - 1 - j)) *= 1 / column[0];
    return true;
  }

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
