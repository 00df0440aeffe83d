#include "weighted_sum.hpp"

#include <cassert>
#include <cstring>

namespace exemplar::learning {
namespace {

// Four doubles that the compiler keeps in one register or in two, as the target allows.
typedef double Four __attribute__((vector_size(32)));

#define EXEMPLAR_INLINE inline __attribute__((always_inline))

EXEMPLAR_INLINE void Load(const double* from, Four& to) { std::memcpy(&to, from, sizeof(Four)); }
EXEMPLAR_INLINE void Store(const Four& from, double* to) { std::memcpy(to, &from, sizeof(Four)); }

struct Columns {
  const double* data;
  Eigen::Index rows, count;
};

EXEMPLAR_INLINE void SumColumns(const Columns& columns, const double* weights, double* sum) {
  Eigen::Index row = 0;
  for (; row + 8 <= columns.rows; row += 8) {
    Four first = {}, second = {};
    const double* at = columns.data + row;
    for (Eigen::Index k = 0; k < columns.count; ++k, at += columns.rows) {
      Four a, b;
      Load(at, a);
      Load(at + 4, b);
      first += weights[k] * a;
      second += weights[k] * b;
    }
    Store(first, sum + row);
    Store(second, sum + row + 4);
  }
  for (; row < columns.rows; ++row) {
    sum[row] = 0;
    for (Eigen::Index k = 0; k < columns.count; ++k) {
      sum[row] += weights[k] * columns.data[k * columns.rows + row];
    }
  }
}

// `weights`: three rows of `values.rows` each, one after the other.
EXEMPLAR_INLINE void SumBlocks(const Columns& values, const double* weights, double* sum) {
  const Eigen::Index m = values.rows;
  for (Eigen::Index column = 0; column < values.count; ++column, sum += 3) {
    const double* at = values.data + column * m;
    Four x = {}, y = {}, z = {};
    Eigen::Index k = 0;
    for (; k + 4 <= m; k += 4) {
      Four value, wx, wy, wz;
      Load(at + k, value);
      Load(weights + k, wx);
      Load(weights + m + k, wy);
      Load(weights + 2 * m + k, wz);
      x += wx * value;
      y += wy * value;
      z += wz * value;
    }
    double rest[3] = {0, 0, 0};
    for (; k < m; ++k) {
      for (int axis = 0; axis < 3; ++axis) rest[axis] += weights[axis * m + k] * at[k];
    }
    sum[0] = rest[0] + (x[0] + x[1]) + (x[2] + x[3]);
    sum[1] = rest[1] + (y[0] + y[1]) + (y[2] + y[3]);
    sum[2] = rest[2] + (z[0] + z[1]) + (z[2] + z[3]);
  }
}

#if defined(__x86_64__)
__attribute__((target("avx2,fma"))) void SumColumnsWide(const Columns& columns,
                                                        const double* weights, double* sum) {
  SumColumns(columns, weights, sum);
}
__attribute__((target("avx2,fma"))) void SumBlocksWide(const Columns& values, const double* weights,
                                                       double* sum) {
  SumBlocks(values, weights, sum);
}
bool HasWide() {
  static const bool has = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return has;
}
#else
void SumColumnsWide(const Columns&, const double*, double*) {}
void SumBlocksWide(const Columns&, const double*, double*) {}
bool HasWide() { return false; }
#endif

Columns ColumnsOf(const Eigen::MatrixXd& matrix) {
  return {matrix.data(), matrix.rows(), matrix.cols()};
}

}  // namespace

Eigen::VectorXd WeightedSum(const Eigen::MatrixXd& columns,
                            const Eigen::Ref<const Eigen::VectorXd>& weights) {
  assert(columns.cols() == weights.size());
  Eigen::VectorXd sum(columns.rows());
  (HasWide() ? SumColumnsWide : SumColumns)(ColumnsOf(columns), weights.data(), sum.data());
  return sum;
}

Eigen::Matrix3Xd WeightedBlocks(const Eigen::Ref<const Eigen::Matrix3Xd>& weights,
                                const Eigen::MatrixXd& values) {
  assert(weights.cols() == values.rows());
  const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> rows = weights;
  Eigen::Matrix3Xd sum(3, values.cols());
  (HasWide() ? SumBlocksWide : SumBlocks)(ColumnsOf(values), rows.data(), sum.data());
  return sum;
}

}  // namespace exemplar::learning
