#include "weighted_sum.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>

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

// `last`: where the sum of the last tile goes.
EXEMPLAR_INLINE void SumTiles(const Tiles& from, const double* weights, double* sum, double* last) {
  const double* at = from.data;
  for (Eigen::Index tile = 0; tile < from.tiles; ++tile) {
    Four first = {}, second = {};
    for (Eigen::Index k = 0; k < from.count; ++k, at += kTile) {
      Four a, b;
      Load(at, a);
      Load(at + 4, b);
      first += weights[k] * a;
      second += weights[k] * b;
    }
    double* to = tile + 1 < from.tiles ? sum + tile * kTile : last;
    Store(first, to);
    Store(second, to + 4);
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

typedef std::int32_t FourSteps __attribute__((vector_size(16)));

EXEMPLAR_INLINE void LoadSteps(const std::int32_t* from, Four& to) {
  FourSteps steps;
  std::memcpy(&steps, from, sizeof(FourSteps));
  to = __builtin_convertvector(steps, Four);
}

struct RoundedTiles {
  const double* mean;
  const std::int32_t* steps;
  Eigen::Index tiles, count;
};

EXEMPLAR_INLINE void SumRounded(const RoundedTiles& from, double of_mean, const double* weights,
                                double* sum, double* last) {
  const std::int32_t* at = from.steps;
  const double* mean = from.mean;
  for (Eigen::Index tile = 0; tile < from.tiles; ++tile, mean += kTile) {
    Four first, second;
    Load(mean, first);
    Load(mean + 4, second);
    first *= of_mean;
    second *= of_mean;
    for (Eigen::Index k = 0; k < from.count; ++k, at += kTile) {
      Four a, b;
      LoadSteps(at, a);
      LoadSteps(at + 4, b);
      first += weights[k] * a;
      second += weights[k] * b;
    }
    double* to = tile + 1 < from.tiles ? sum + tile * kTile : last;
    Store(first, to);
    Store(second, to + 4);
  }
}

EXEMPLAR_WIDE void SumRoundedWide(const RoundedTiles& from, double of_mean, const double* weights,
                                  double* sum, double* last) {
  SumRounded(from, of_mean, weights, sum, last);
}

EXEMPLAR_WIDE void SumTilesWide(const Tiles& from, const double* weights, double* sum,
                                double* last) {
  SumTiles(from, weights, sum, last);
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

void Streams::SumTo(const Eigen::Ref<const Eigen::VectorXd>& weights, double* sum) const {
  assert(weights.size() == count_);
  if (tiles_.empty()) {
    std::fill(sum, sum + rows_, 0.0);
    return;
  }
  const Eigen::Index tiles = (rows_ + kTile - 1) / kTile;
  double last[kTile];
  (HasWide() ? SumTilesWide : SumTiles)({tiles_.front().values, tiles, count_}, weights.data(), sum,
                                        last);
  const Eigen::Index before = (tiles - 1) * kTile;
  std::copy(last, last + (rows_ - before), sum + before);
}

Eigen::VectorXd Streams::Sum(const Eigen::Ref<const Eigen::VectorXd>& weights) const {
  Eigen::VectorXd sum(rows_);
  SumTo(weights, sum.data());
  return sum;
}

Eigen::MatrixXd Streams::Sum(const Eigen::Ref<const Eigen::VectorXd>& weights, Eigen::Index rows,
                             Eigen::Index columns) const {
  assert(rows * columns == rows_);
  Eigen::MatrixXd sum(rows, columns);
  SumTo(weights, sum.data());
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

RoundedStreams::RoundedStreams(const Eigen::Ref<const Eigen::MatrixXd>& columns)
    : rows_(columns.rows()), count_(columns.cols()) {
  if (columns.size() == 0) return;
  const Eigen::VectorXd mean = columns.rowwise().mean();
  const double furthest = (columns.colwise() - mean).cwiseAbs().maxCoeff();
  step_ = furthest / std::numeric_limits<std::int32_t>::max();
  const Eigen::Index tiles = (rows_ + kTile - 1) / kTile;
  mean_.resize(static_cast<std::size_t>(tiles * kTile));
  std::copy(mean.begin(), mean.end(), mean_.begin());
  tiles_.resize(static_cast<std::size_t>(tiles * count_));
  if (step_ < std::numeric_limits<double>::min()) {
    step_ = 0;
    return;
  }
  auto to = tiles_.begin();
  for (Eigen::Index row = 0; row < rows_; row += kTile) {
    const Eigen::Index used = std::min(kTile, rows_ - row);
    for (Eigen::Index k = 0; k < count_; ++k, ++to) {
      for (Eigen::Index r = 0; r < used; ++r) {
        to->steps[r] =
            static_cast<std::int32_t>(std::lround((columns(row + r, k) - mean[row + r]) / step_));
      }
    }
  }
}

Eigen::MatrixXd RoundedStreams::Sum(const Eigen::Ref<const Eigen::VectorXd>& weights,
                                    Eigen::Index rows, Eigen::Index columns) const {
  assert(weights.size() == count_ && rows * columns == rows_);
  Eigen::MatrixXd sum(rows, columns);
  if (tiles_.empty()) {
    sum.setZero();
    return sum;
  }
  const Eigen::Index tiles = (rows_ + kTile - 1) / kTile;
  const Eigen::VectorXd steps = step_ * weights;
  double last[kTile];
  (HasWide() ? SumRoundedWide : SumRounded)({mean_.data(), tiles_.front().steps, tiles, count_},
                                            weights.sum(), steps.data(), sum.data(), last);
  const Eigen::Index before = (tiles - 1) * kTile;
  std::copy(last, last + (rows_ - before), sum.data() + before);
  return sum;
}

}  // namespace exemplar::learning
