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
/// a radius, a capsule a segment. Immutable, cheap to copy.
class ConvexShape {
 public:
  /// Errors name the size at fault. Precondition: not a mesh.
  static Result<ConvexShape> Create(const kinematics::Shape& shape);
  /// The hull of points, or of so many that it, with a radius, contains all.
  static Result<ConvexShape> OfPoints(std::span<const Eigen::Vector3d> points);

  /// The point of the whole body (core and radius) farthest along `direction`, in its own frame.
  Eigen::Vector3d Support(const Eigen::Vector3d& direction) const;
  /// As Support, of the core alone.
  Eigen::Vector3d CoreSupport(const Eigen::Vector3d& direction) const;
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
  /// kHull: three corners (indices into vertices()) a face, counter-clockwise from outside.
  std::span<const int> faces() const {
    return faces_ ? std::span<const int>(*faces_) : std::span<const int>();
  }
  struct Fcl;  ///< the geometries as FCL wants them
  const Fcl& fcl() const { return *fcl_; }

 private:
  ConvexShape() = default;
  void Keep(const std::shared_ptr<Fcl>& fcl);

  Core core_ = Core::kPoint;
  double radius_ = 0;
  Eigen::Vector3d half_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  // Shared: FCL's geometries refer to the vertices, and copies of a shape are the same shape.
  std::shared_ptr<const std::vector<Eigen::Vector3d>> vertices_;
  std::shared_ptr<const std::vector<int>> faces_;
  std::shared_ptr<const Fcl> fcl_;
};

struct Separation {
  double distance_m = 0;  ///< negative: penetration depth
  Eigen::Vector3d p_first = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_second = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, from first to second
};

/// Signed distance. Pairs of spheres and capsules, and spheres with boxes and cylinders, by closed
/// forms; else GJK between the cores, ours and where that is not sure FCL's, checked by the support
/// planes at the answer: what is returned is never more than the true distance by more than
/// rounding. A depth is that of the best direction found among FCL's contact normals and the
/// bodies' own axes: exact for shallow contacts of round bodies and for boxes' faces, an upper
/// bound else.
Separation SignedDistance(const ConvexShape& first, const Placement& first_at,
                          const ConvexShape& second, const Placement& second_at);

}  // namespace exemplar::collision
