#pragma once
// One convex body and the distance between two of them. The only header of the project behind which
// FCL stands.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/geometry/pose.hpp"
#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::collision {

/// A rotation and translation ready for many points.
struct Placement {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  static Placement From(const geometry::Pose& pose) {
    return {pose.rotation.toRotationMatrix(), pose.translation};
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return rotation * p + translation; }
};

/// Axis-aligned bounds.
struct Bounds {
  Eigen::Vector3d lower = Eigen::Vector3d::Zero();
  Eigen::Vector3d upper = Eigen::Vector3d::Zero();
};

/// 0 where they overlap; never more than the distance of what is inside.
double Distance(const Bounds& a, const Bounds& b);

/// A core (point, segment, box, cylinder or hull) and a radius around it: a sphere is a point with
/// a radius, a capsule a segment. Meshes are taken by their convex hull. Immutable, cheap to copy.
class ConvexShape {
 public:
  /// Errors name the size at fault, or the mesh file.
  static Result<ConvexShape> Create(const kinematics::Shape& shape);

  /// The point of the whole body (core and radius) farthest along `direction`, in its own frame.
  Eigen::Vector3d Support(const Eigen::Vector3d& direction) const;
  Bounds BoundsAt(const Placement& placement) const;
  /// The largest distance of a point of the body from the origin of its frame.
  double reach() const;

  enum class Core { kPoint, kSegment, kBox, kCylinder, kHull };
  Core core() const { return core_; }
  double radius() const { return radius_; }
  /// kSegment: z; kBox: all; kCylinder: x is the radius, z half the length; kHull: of its bounds.
  const Eigen::Vector3d& half() const { return half_; }
  /// kHull: its corners; empty else.
  std::span<const Eigen::Vector3d> vertices() const {
    return vertices_ ? std::span<const Eigen::Vector3d>(*vertices_)
                     : std::span<const Eigen::Vector3d>();
  }
  struct Fcl;  ///< the geometries as FCL wants them
  const Fcl& fcl() const { return *fcl_; }

 private:
  ConvexShape() = default;

  Core core_ = Core::kPoint;
  double radius_ = 0;
  Eigen::Vector3d half_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  // Shared: FCL's geometries refer to the vertices, and copies of a shape are the same shape.
  std::shared_ptr<const std::vector<Eigen::Vector3d>> vertices_;
  std::shared_ptr<const Fcl> fcl_;
};

struct Separation {
  double distance_m = 0;  ///< negative: penetration depth
  Eigen::Vector3d p_first = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_second = Eigen::Vector3d::Zero();
};

/// Signed distance. Pairs of spheres and capsules, and spheres with boxes and cylinders, by closed
/// forms; else FCL's GJK between the cores, checked by the support planes at the answer: what is
/// returned is never more than the true distance by more than rounding. A depth is that of the best
/// direction found among FCL's contact normals and the bodies' own axes: exact for shallow contacts
/// of round bodies and for boxes' faces, an upper bound else.
Separation SignedDistance(const ConvexShape& first, const Placement& first_at,
                          const ConvexShape& second, const Placement& second_at);

}  // namespace exemplar::collision
