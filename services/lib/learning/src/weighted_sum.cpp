#include "weighted_sum.hpp"

#include <algorithm>
#include <cassert>

#include "exemplar/geometry/wide.hpp"

namespace exemplar::learning {
namespace {

using geometry::Four;
using geometry::HasWide;
using geometry::Load;
using geometry::Store;

constexpr Eigen::Index kTile = 8;

struct Tiles {
  const double* data;
  Eigen::Index tiles, count;
};

EXEMPLAR_INLINE void SumTiles(const Tiles& from, const double* weights, double* sum) {
  const double* at = from.data;
  for (Eigen::Index tile = 0; tile < from.tiles; ++tile, sum += kTile) {
    Four first = {}, second = {};
    for (Eigen::Index k = 0; k < from.count; ++k, at += kTile) {
      Four a, b;
      Load(at, a);
      Load(at + 4, b);
      first += weights[k] * a;
      second += weights[k] * b;
    }
    Store(first, sum);
    Store(second, sum + 4);
  }
}

// `weights`: x of all columns, then y, then z; `sum`: likewise, `stride` numbers apart.
EXEMPLAR_INLINE void SumTiles3(const Tiles& from, const double* weights, double* sum,
                               Eigen::Index stride) {
  const double* at = from.data;
  for (Eigen::Index tile = 0; tile < from.tiles; ++tile, sum += kTile) {
    Four x1 = {}, x2 = {}, y1 = {}, y2 = {}, z1 = {}, z2 = {};
    for (Eigen::Index k = 0; k < from.count; ++k, at += kTile) {
      Four a, b;
      Load(at, a);
      Load(at + 4, b);
      x1 += weights[k] * a;
      x2 += weights[k] * b;
      y1 += weights[from.count + k] * a;
      y2 += weights[from.count + k] * b;
      z1 += weights[2 * from.count + k] * a;
      z2 += weights[2 * from.count + k] * b;
    }
    Store(x1, sum);
    Store(x2, sum + 4);
    Store(y1, sum + stride);
    Store(y2, sum + stride + 4);
    Store(z1, sum + 2 * stride);
    Store(z2, sum + 2 * stride + 4);
  }
}

EXEMPLAR_WIDE void SumTilesWide(const Tiles& from, const double* weights, double* sum) {
  SumTiles(from, weights, sum);
}
EXEMPLAR_WIDE void SumTiles3Wide(const Tiles& from, const double* weights, double* sum,
                                 Eigen::Index stride) {
  SumTiles3(from, weights, sum, stride);
}

}  // namespace

Streams::Streams(const Eigen::Ref<const Eigen::MatrixXd>& columns)
    : rows_(columns.rows()), count_(columns.cols()) {
  const Eigen::Index tiles = (rows_ + kTile - 1) / kTile;
  tiles_.resize(static_cast<std::size_t>(tiles * count_));
  auto to = tiles_.begin();
  for (Eigen::Index row = 0; row < rows_; row += kTile) {
    const Eigen::Index used = std::min(kTile, rows_ - row);
    for (Eigen::Index k = 0; k < count_; ++k, ++to) {
      for (Eigen::Index r = 0; r < used; ++r) to->values[r] = columns(row + r, k);
    }
  }
}

Eigen::VectorXd Streams::Sum(const Eigen::Ref<const Eigen::VectorXd>& weights) const {
  assert(weights.size() == count_);
  if (tiles_.empty()) return Eigen::VectorXd::Zero(rows_);
  const Eigen::Index tiles = (rows_ + kTile - 1) / kTile;
  Eigen::VectorXd sum(tiles * kTile);
  (HasWide() ? SumTilesWide : SumTiles)({tiles_.front().values, tiles, count_}, weights.data(),
                                        sum.data());
  sum.conservativeResize(rows_);
  return sum;
}

Eigen::MatrixX3d Streams::Sum3(const Eigen::Ref<const Eigen::MatrixX3d>& weights) const {
  assert(weights.rows() == count_ && weights.outerStride() == count_);
  if (tiles_.empty()) return Eigen::MatrixX3d::Zero(rows_, 3);
  const Eigen::Index tiles = (rows_ + kTile - 1) / kTile;
  Eigen::MatrixX3d sum(tiles * kTile, 3);
  (HasWide() ? SumTiles3Wide : SumTiles3)({tiles_.front().values, tiles, count_}, weights.data(),
                                          sum.data(), tiles * kTile);
  if (sum.rows() != rows_) sum.conservativeResize(rows_, 3);
  return sum;
}

}  // namespace exemplar::learning
