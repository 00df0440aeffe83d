#pragma once
// The convex hull of a point cloud.

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::collision {

struct Hull {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> faces;  ///< counter-clockwise seen from outside
  double cloud_size = 0;                  ///< what the tolerance is a share of
};

/// Quickhull (Barber, Dobkin & Huhdanpaa 1996). Points that stand out of a face by no more than
/// `tolerance_share` of the cloud's size count as inside. kInvalidArgument when the points span no
/// volume.
Result<Hull> ConvexHull(std::span<const Eigen::Vector3d> points, double tolerance_share = 1e-9);

}  // namespace exemplar::collision
