#pragma once
// Points as the cells of an octree that hold them.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "convex_shape.hpp"
#include "exemplar/base/result.hpp"

namespace exemplar::collision {

/// Cubes of edge `resolution_m` that hold a point, on a grid through the origin; eight that fill
/// the next larger cube of the tree become that one. Errors name the point at fault.
Result<std::vector<Bounds>> OctreeCells(std::span<const Eigen::Vector3d> points,
                                        double resolution_m);

}  // namespace exemplar::collision
