#include "bounding_capsule.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "segments.hpp"

namespace exemplar::collision {
namespace {

constexpr int kCirclePoints = 24;
constexpr int kCircleRounds = 60;
constexpr double kSlack_m = 1e-9;
constexpr double kFirstTurn_rad = 0.3;
constexpr double kLastTurn_rad = 0.01;

/// Points whose hull contains the body.
std::vector<Eigen::Vector3d> OuterPoints(const ConvexShape& shape) {
  std::vector<Eigen::Vector3d> points;
  if (shape.core() == ConvexShape::Core::kHull) {
    return {shape.vertices().begin(), shape.vertices().end()};
  }
  const Eigen::Vector3d& half = shape.half();
  if (shape.core() == ConvexShape::Core::kBox) {
    for (int corner = 0; corner < 8; ++corner) {
      points.emplace_back((corner & 1) != 0 ? half.x() : -half.x(),
                          (corner & 2) != 0 ? half.y() : -half.y(),
                          (corner & 4) != 0 ? half.z() : -half.z());
    }
    return points;
  }
  // A prism around the cylinder.
  const double radius = half.x() / std::cos(std::numbers::pi / kCirclePoints);
  for (int i = 0; i < kCirclePoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCirclePoints;
    for (const double z : {-half.z(), half.z()}) {
      points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  return points;
}

/// The smallest capsule along an axis: near the smallest circle around the points seen along it
/// (Badoiu & Clarkson 2003), or a little wider and shorter.
BoundingCapsule FitAlong(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& axis) {
  const auto across = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return p - p.dot(axis) * axis;
  };
  Eigen::Vector3d centre = across(points.front());
  for (int round = 1; round <= kCircleRounds; ++round) {
    double farthest = -1;
    Eigen::Vector3d towards = centre;
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector3d seen = across(p);
      const double distance = (seen - centre).squaredNorm();
      if (distance <= farthest) continue;
      farthest = distance;
      towards = seen;
    }
    centre += (towards - centre) / (round + 1);
  }
  double narrowest = 0;
  for (const Eigen::Vector3d& p : points) {
    narrowest = std::max(narrowest, (across(p) - centre).norm());
  }
  BoundingCapsule best;
  double smallest = -1;
  for (const double wider : {1.0, 1.02, 1.05, 1.1, 1.2, 1.4}) {
    const double radius = wider * narrowest + kSlack_m;
    // Each point must be within the radius of a point of the segment.
    double low = 1e300;
    double high = -1e300;
    for (const Eigen::Vector3d& p : points) {
      const double reach =
          std::sqrt(std::max(0.0, radius * radius - (across(p) - centre).squaredNorm()));
      low = std::min(low, p.dot(axis) + reach);
      high = std::max(high, p.dot(axis) - reach);
    }
    const double middle = 0.5 * (low + high);
    const BoundingCapsule capsule = {centre + middle * axis, axis,
                                     std::max(0.0, 0.5 * (high - low)), radius};
    if (smallest < 0 || capsule.volume() < smallest) {
      smallest = capsule.volume();
      best = capsule;
    }
  }
  return best;
}

Eigen::Vector3d AnyAcross(const Eigen::Vector3d& axis) {
  const Eigen::Vector3d other =
      std::abs(axis.x()) < 0.7 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  return axis.cross(other).normalized();
}

}  // namespace

double BoundingCapsule::volume() const {
  return std::numbers::pi * radius * radius * (2 * half + 4.0 / 3.0 * radius);
}

BoundingCapsule FitCapsule(const ConvexShape& shape) {
  if (shape.core() == ConvexShape::Core::kPoint) {
    return {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ(), 0, shape.radius()};
  }
  if (shape.core() == ConvexShape::Core::kSegment) {
    return {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ(), shape.half().z(), shape.radius()};
  }
  const std::vector<Eigen::Vector3d> points = OuterPoints(shape);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
  const Eigen::Matrix3d principal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
  BoundingCapsule best = FitAlong(points, principal.col(2));
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector3d axis =
        i < 2 ? Eigen::Vector3d(principal.col(i)) : Eigen::Vector3d::Unit(i - 2);
    const BoundingCapsule tried = FitAlong(points, axis);
    if (tried.volume() < best.volume()) best = tried;
  }
  for (double turn = kFirstTurn_rad; turn > kLastTurn_rad;) {
    const Eigen::Vector3d u = AnyAcross(best.axis);
    const Eigen::Vector3d v = best.axis.cross(u);
    BoundingCapsule better = best;
    for (const Eigen::Vector3d& side : {u, v, Eigen::Vector3d(-u), Eigen::Vector3d(-v)}) {
      const BoundingCapsule tried = FitAlong(points, (best.axis + turn * side).normalized());
      if (tried.volume() < better.volume()) better = tried;
    }
    if (better.volume() < best.volume() * (1 - 1e-6)) {
      best = better;
    } else {
      turn *= 0.5;
    }
  }
  best.radius += shape.radius();
  return best;
}

double Distance(const BoundingCapsule& a, const BoundingCapsule& b, Eigen::Vector3d& on_a,
                Eigen::Vector3d& on_b) {
  NearestOfSegments(a.centre, a.axis, a.half, b.centre, b.axis, b.half, on_a, on_b);
  return (on_a - on_b).norm() - a.radius - b.radius;
}

}  // namespace exemplar::collision
