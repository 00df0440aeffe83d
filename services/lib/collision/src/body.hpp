#pragma once
// What stands for a shape in all checks.

#include <memory>
#include <span>
#include <vector>

#include "convex_shape.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/kinematics/robot_model.hpp"
#include "pieces.hpp"

namespace exemplar::collision {

/// A convex shape that contains the body and, where it is more than that, the body's pieces.
struct Body {
  ConvexShape hull;
  std::shared_ptr<const Pieces> pieces;  ///< null: the hull is the body
};

/// A mesh that fills its convex hull but for 0.1 mm, or is marked convex, is its hull. Errors name
/// the size at fault, or the mesh file and what is wrong with it.
Result<Body> MakeBody(const kinematics::Shape& shape);
/// The octree cells of points; errors name the point or the resolution.
Result<Body> MakeCloudBody(std::span<const Eigen::Vector3d> points, double resolution_m);

/// Signed distance; see SignedDistance and DistanceOfPieces. At `ignore_beyond_m` and more it may
/// be any value from there on.
Separation Distance(const Body& first, const Placement& first_at, const Body& second,
                    const Placement& second_at, double ignore_beyond_m);

}  // namespace exemplar::collision
