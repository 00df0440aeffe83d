#pragma once
// From the loose triangles of a mesh file to a closed surface.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "exemplar/base/result.hpp"
#include "pieces.hpp"

namespace exemplar::collision {

struct SolidMesh {
  std::vector<Triangle> triangles;            ///< those with an area
  std::vector<Eigen::Vector3d> shell_points;  ///< one of each connected part of the surface
  double volume_m3 = 0;  ///< enclosed, where the triangles are turned alike; else too small
};

/// Joins corners nearer than 1e-6 of the mesh's size and leaves out triangles that vanish.
/// `corners`: three a triangle. kInvalidArgument when an edge has a triangle on one side only: the
/// error counts such edges and names one.
Result<SolidMesh> MakeSolidMesh(std::span<const Eigen::Vector3d> corners);

}  // namespace exemplar::collision
