#include "rotations.hpp"

#include <algorithm>
#include <array>
#include <cassert>

#include "exemplar/geometry/wide.hpp"

namespace exemplar::learning {
namespace {

using geometry::AllAtMost;
using geometry::CosineAndSinc;
using geometry::Four;
using geometry::FourQuaternions;
using geometry::HasWide;
using geometry::kLargestSeriesAngle;
using geometry::Load;
using geometry::Multiply;
using geometry::Polynomial;
using geometry::Store;

// asin(s) / s in s^2; what is left out is below rounding up to kLargestSine.
constexpr std::array<double, 17> ArcSineSeries() {
  std::array<double, 17> series = {1.0};
  double central = 1;  // (2k)! / (4^k k!^2)
  for (std::size_t k = 1; k < series.size(); ++k) {
    const auto n = static_cast<double>(k);
    central *= (2 * n - 1) / (2 * n);
    series[k] = central / (2 * n + 1);
  }
  return series;
}
constexpr std::array<double, 17> kArcSine = ArcSineSeries();
constexpr double kLargestSine = 0.3;

// Columns of numbers `stride` apart.
struct Rows {
  const double* data;
  Eigen::Index stride;
};

EXEMPLAR_INLINE void LoadQuaternions(const Rows& rows, Eigen::Index at, FourQuaternions& q) {
  Load(rows.data + at, q.x);
  Load(rows.data + rows.stride + at, q.y);
  Load(rows.data + 2 * rows.stride + at, q.z);
  Load(rows.data + 3 * rows.stride + at, q.w);
}

EXEMPLAR_INLINE void StoreQuaternions(const FourQuaternions& q, Eigen::Index at,
                                      Eigen::Index stride, double* to) {
  Store(q.x, to + at);
  Store(q.y, to + stride + at);
  Store(q.z, to + 2 * stride + at);
  Store(q.w, to + 3 * stride + at);
}

// Four rows from `at`; false where an angle is too large for the series.
EXEMPLAR_INLINE bool TurnFour(const FourQuaternions& left, const Rows& q, const Rows& vectors,
                              Eigen::Index at, double* to) {
  Four x, y, z;
  Load(vectors.data + at, x);
  Load(vectors.data + vectors.stride + at, y);
  Load(vectors.data + 2 * vectors.stride + at, z);
  const Four squared = (x * x + y * y + z * z) * 0.25;
  if (!AllAtMost(squared, kLargestSeriesAngle * kLargestSeriesAngle)) return false;
  FourQuaternions turn;
  Four sinc;
  CosineAndSinc(squared, turn.w, sinc);
  sinc *= 0.5;
  turn.x = sinc * x;
  turn.y = sinc * y;
  turn.z = sinc * z;
  FourQuaternions from, placed, turned;
  LoadQuaternions(q, at, from);
  Multiply(left, from, placed);
  Multiply(placed, turn, turned);
  StoreQuaternions(turned, at, q.stride, to);
  return true;
}

EXEMPLAR_INLINE bool FourBetween(const Rows& a, const Rows& b, const double* part, Eigen::Index at,
                                 double* to) {
  FourQuaternions first, last, way;
  LoadQuaternions(a, at, first);
  LoadQuaternions(b, at, last);
  const FourQuaternions back = {-first.x, -first.y, -first.z, first.w};
  Multiply(back, last, way);
  const Four squared = way.x * way.x + way.y * way.y + way.z * way.z;
  if (!AllAtMost(squared, kLargestSine * kLargestSine)) return false;
  Four s;
  Load(part + at, s);
  Four angle;  // half the way's over its sine
  Polynomial(kArcSine, squared, angle);
  const Four half = s * s * angle * angle * squared;
  // The other of both quaternions of a rotation is the same rotation.
  const Four one = Four{} + 1.0;
  const Four sign = way.w < 0 ? -one : one;
  FourQuaternions turn;
  Four sinc;
  CosineAndSinc(half, turn.w, sinc);
  const Four scale = sinc * s * angle * sign;
  turn.x = scale * way.x;
  turn.y = scale * way.y;
  turn.z = scale * way.z;
  FourQuaternions turned;
  Multiply(first, turn, turned);
  StoreQuaternions(turned, at, a.stride, to);
  return true;
}

EXEMPLAR_INLINE Eigen::Index TurnMany(const Eigen::Quaterniond& left, const Rows& q,
                                      const Rows& vectors, Eigen::Index at, Eigen::Index end,
                                      double* to) {
  const FourQuaternions all = {Four{} + left.x(), Four{} + left.y(), Four{} + left.z(),
                               Four{} + left.w()};
  while (at + 4 <= end && TurnFour(all, q, vectors, at, to)) at += 4;
  return at;
}
EXEMPLAR_WIDE Eigen::Index TurnManyWide(const Eigen::Quaterniond& left, const Rows& q,
                                        const Rows& vectors, Eigen::Index at, Eigen::Index end,
                                        double* to) {
  return TurnMany(left, q, vectors, at, end, to);
}

EXEMPLAR_INLINE Eigen::Index ManyBetween(const Rows& a, const Rows& b, const double* part,
                                         Eigen::Index at, Eigen::Index end, double* to) {
  while (at + 4 <= end && FourBetween(a, b, part, at, to)) at += 4;
  return at;
}
EXEMPLAR_WIDE Eigen::Index ManyBetweenWide(const Rows& a, const Rows& b, const double* part,
                                           Eigen::Index at, Eigen::Index end, double* to) {
  return ManyBetween(a, b, part, at, end, to);
}

Eigen::Quaterniond RowOf(const Eigen::MatrixX4d& q, Eigen::Index i) {
  return Eigen::Quaterniond(q(i, 3), q(i, 0), q(i, 1), q(i, 2));
}

}  // namespace

Eigen::MatrixX4d FromQuaternions(std::span<const Eigen::Quaterniond> rotations) {
  Eigen::MatrixX4d q(static_cast<Eigen::Index>(rotations.size()), 4);
  for (Eigen::Index i = 0; i < q.rows(); ++i) {
    q.row(i) = rotations[static_cast<std::size_t>(i)].coeffs().transpose();
  }
  return q;
}

Eigen::MatrixX4d Turned(const Eigen::Quaterniond& left, const Eigen::MatrixX4d& q,
                        const Eigen::Ref<const Eigen::MatrixX3d>& vectors) {
  assert(q.rows() == vectors.rows());
  const Eigen::Index n = q.rows();
  Eigen::MatrixX4d turned(n, 4);
  for (Eigen::Index at = 0; at < n;) {
    at = (HasWide() ? TurnManyWide : TurnMany)(
        left, {q.data(), n}, {vectors.data(), vectors.outerStride()}, at, n, turned.data());
    // What is left over, or too far for the series.
    for (const Eigen::Index end = std::min(at + 4, n); at < end; ++at) {
      turned.row(at) = (left * RowOf(q, at) * geometry::ExpSo3(vectors.row(at).transpose()))
                           .coeffs()
                           .transpose();
    }
  }
  return turned;
}

Eigen::MatrixX4d Between(const Eigen::MatrixX4d& a, const Eigen::MatrixX4d& b,
                         const Eigen::VectorXd& part) {
  assert(a.rows() == b.rows() && a.rows() == part.size());
  const Eigen::Index n = a.rows();
  Eigen::MatrixX4d between(n, 4);
  for (Eigen::Index at = 0; at < n;) {
    at = (HasWide() ? ManyBetweenWide : ManyBetween)({a.data(), n}, {b.data(), n}, part.data(), at,
                                                     n, between.data());
    for (const Eigen::Index end = std::min(at + 4, n); at < end; ++at) {
      between.row(at) = RowOf(a, at).slerp(part[at], RowOf(b, at)).coeffs().transpose();
    }
  }
  return between;
}

std::vector<geometry::Pose> ToPoses(const Eigen::Ref<const Eigen::MatrixX3d>& positions,
                                    const Eigen::MatrixX4d& rotations) {
  assert(positions.rows() == rotations.rows());
  const Eigen::Index n = positions.rows();
  std::vector<geometry::Pose> poses;
  poses.reserve(static_cast<std::size_t>(n));
  for (Eigen::Index i = 0; i < n; ++i) {
    poses.push_back(
        {Eigen::Vector3d(positions(i, 0), positions(i, 1), positions(i, 2)), RowOf(rotations, i)});
  }
  return poses;
}

}  // namespace exemplar::learning
