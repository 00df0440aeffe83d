#pragma once
// Capsules around convex bodies: distances between them are quick and never too large.

#include <Eigen/Core>

#include "convex_shape.hpp"

namespace exemplar::collision {

/// All points within `radius` of the segment centre ± half axis.
struct BoundingCapsule {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit
  double half = 0;
  double radius = 0;

  double volume() const;
  BoundingCapsule At(const Placement& placement) const {
    return {placement * centre, placement.rotation * axis, half, radius};
  }
};

/// The smallest capsule found that contains the body, in the body's frame: the best of many axes,
/// refined. Spheres and capsules are themselves.
BoundingCapsule FitCapsule(const ConvexShape& shape);

/// Nearest points of the two segments, not of the surfaces. Returns the distance of the surfaces,
/// negative where they overlap.
double Distance(const BoundingCapsule& a, const BoundingCapsule& b, Eigen::Vector3d& on_a,
                Eigen::Vector3d& on_b);

}  // namespace exemplar::collision
