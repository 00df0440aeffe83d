#include "convex_shape.hpp"

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "convex_hull.hpp"
#include "exemplar/base/text.hpp"
#include "gjk.hpp"
#include "segments.hpp"

namespace exemplar::collision {

struct ConvexShape::Fcl {
  std::shared_ptr<const fcl::CollisionGeometryd> core;   ///< without the radius
  std::shared_ptr<const fcl::CollisionGeometryd> whole;  ///< with it
};

namespace {

using Core = ConvexShape::Core;

/// FCL's GJK stops within this of the true distance on round bodies.
constexpr double kGjkTolerance_m = 1e-6;
/// An answer is taken when it is proved to be this near to the true distance.
constexpr double kCertainty_m = 1e-5;
/// As much for our own GJK, which is asked first.
constexpr double kQuickCertainty_m = 1e-6;
/// Hulls of more points than this are made a little too large rather than exact.
constexpr std::size_t kManyPoints = 10000;
constexpr double kFineHullShare = 1e-9;
constexpr double kRoughHullShare = 1e-4;

bool IsPositive(double value) { return std::isfinite(value) && value > 0; }

Error BadSize(const char* shape, const char* what, double value) {
  return InvalidArgument(std::string(shape) + ": " + what + " is " + FormatDouble(value) +
                         ", must be positive");
}

fcl::Transform3d ToFcl(const Placement& at) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.linear() = at.rotation;
  transform.translation() = at.translation;
  return transform;
}

// ---------------------------------------------------------------- closed forms

Separation BetweenCores(const Eigen::Vector3d& p1, double r1, const Eigen::Vector3d& p2, double r2,
                        const Eigen::Vector3d& fallback_normal) {
  const double length = (p2 - p1).norm();
  const Eigen::Vector3d n = length > 1e-12 ? Eigen::Vector3d((p2 - p1) / length) : fallback_normal;
  return {length - r1 - r2, p1 + r1 * n, p2 - r2 * n, n};
}

/// A point against a box or cylinder: signed distance and the surface point, in the solid's frame.
double PointToSolid(const ConvexShape& solid, const Eigen::Vector3d& p, Eigen::Vector3d& surface) {
  if (solid.core() == Core::kBox) {
    const Eigen::Vector3d q = p.cwiseAbs() - solid.half();
    if ((q.array() > 0).any()) {
      surface = p.cwiseMax(-solid.half()).cwiseMin(solid.half());
      return (p - surface).norm();
    }
    int axis = 0;
    const double inside = q.maxCoeff(&axis);
    surface = p;
    surface[axis] = p[axis] < 0 ? -solid.half()[axis] : solid.half()[axis];
    return inside;
  }
  const double radius = solid.half().x();
  const double half = solid.half().z();
  const double rho = p.head<2>().norm();
  const Eigen::Vector2d outward =
      rho > 1e-12 ? Eigen::Vector2d(p.head<2>() / rho) : Eigen::Vector2d::UnitX();
  const double side = rho - radius;
  const double end = std::abs(p.z()) - half;
  surface.z() = std::clamp(p.z(), -half, half);
  surface.head<2>() = std::min(rho, radius) * outward;
  if (side > 0 || end > 0) return (p - surface).norm();
  if (side > end) {
    surface.head<2>() = radius * outward;
    return side;
  }
  surface.z() = p.z() < 0 ? -half : half;
  return end;
}

Separation PointAgainstSolid(const ConvexShape& ball, const Placement& ball_at,
                             const ConvexShape& solid, const Placement& solid_at) {
  const Eigen::Vector3d centre =
      solid_at.rotation.transpose() * (ball_at.translation - solid_at.translation);
  Eigen::Vector3d surface;
  const double distance = PointToSolid(solid, centre, surface);
  Eigen::Vector3d n = surface - centre;  // towards the surface
  if (distance < 0) n = -n;              // and out of the solid, back to its surface
  const double length = n.norm();
  n = length > 1e-12 ? Eigen::Vector3d(n / length) : Eigen::Vector3d(-Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d on_ball = centre + ball.radius() * n;
  return {distance - ball.radius(), solid_at * on_ball, solid_at * surface, solid_at.rotation * n};
}

// ---------------------------------------------------------------- by support planes and FCL

/// The room between the bodies along the unit direction `n` from first to second: a lower bound of
/// the distance where positive, an upper bound of the depth where negative.
Separation Along(const Eigen::Vector3d& n, const ConvexShape& first, const Placement& first_at,
                 const ConvexShape& second, const Placement& second_at) {
  const Eigen::Vector3d p1 = first_at * first.Support(first_at.rotation.transpose() * n);
  const Eigen::Vector3d p2 = second_at * second.Support(-(second_at.rotation.transpose() * n));
  return {n.dot(p2 - p1), p1, p2, n};
}

class BestDirection {
 public:
  BestDirection(const ConvexShape& first, const Placement& first_at, const ConvexShape& second,
                const Placement& second_at)
      : first_(first), first_at_(first_at), second_(second), second_at_(second_at) {
    best_.distance_m = -std::numeric_limits<double>::infinity();
  }

  void Try(const Eigen::Vector3d& direction) {
    const double length = direction.norm();
    if (!(length > 1e-12)) return;
    TryUnit(direction / length);
    TryUnit(-direction / length);
  }

  const Separation& best() const { return best_; }

 private:
  void TryUnit(const Eigen::Vector3d& n) {
    const Separation found = Along(n, first_, first_at_, second_, second_at_);
    if (found.distance_m > best_.distance_m) best_ = found;
  }

  const ConvexShape& first_;
  const Placement& first_at_;
  const ConvexShape& second_;
  const Placement& second_at_;
  Separation best_;
};

Separation Penetration(const ConvexShape& first, const Placement& first_at,
                       const ConvexShape& second, const Placement& second_at) {
  BestDirection direction(first, first_at, second, second_at);
  direction.Try(second_at.translation - first_at.translation);
  for (int axis = 0; axis < 3; ++axis) {
    direction.Try(first_at.rotation.col(axis));
    direction.Try(second_at.rotation.col(axis));
    for (int other = 0; other < 3; ++other) {
      direction.Try(first_at.rotation.col(axis).cross(second_at.rotation.col(other)));
    }
  }
  fcl::CollisionRequestd request(8, true);
  fcl::CollisionResultd result;
  try {
    fcl::collide(first.fcl().whole.get(), ToFcl(first_at), second.fcl().whole.get(),
                 ToFcl(second_at), request, result);
  } catch (const std::exception&) {
    // FCL gives up on some degenerate configurations; the axes above stand.
    return direction.best();
  }
  for (std::size_t i = 0; i < result.numContacts(); ++i) {
    direction.Try(result.getContact(i).normal);
  }
  return direction.best();
}

/// What FCL says of the nearest points of two cores.
struct Nearest {
  bool apart = false;
  Eigen::Vector3d p_first = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_second = Eigen::Vector3d::Zero();
};

Nearest AskFcl(const ConvexShape& first, const Placement& first_at, const ConvexShape& second,
               const Placement& second_at, fcl::GJKSolverType solver) {
  fcl::DistanceRequestd request(true, false);
  request.distance_tolerance = kGjkTolerance_m;
  request.gjk_solver_type = solver;
  fcl::DistanceResultd result;
  double distance = -1;
  try {
    distance = fcl::distance(first.fcl().core.get(), ToFcl(first_at), second.fcl().core.get(),
                             ToFcl(second_at), request, result);
  } catch (const std::exception&) {
    return {};  // FCL gives up on some degenerate configurations
  }
  const Nearest nearest{distance > 1e-9, result.nearest_points[0], result.nearest_points[1]};
  const double length = (nearest.p_second - nearest.p_first).norm();
  return length > 1e-9 && std::isfinite(length) ? nearest : Nearest{};
}

Separation ByGjk(const ConvexShape& first, const Placement& first_at, const ConvexShape& second,
                 const Placement& second_at) {
  const auto core_of = [](const ConvexShape& shape, const Placement& at) {
    return [&shape, &at](const Eigen::Vector3d& d) -> Eigen::Vector3d {
      return at * shape.CoreSupport(at.rotation.transpose() * d);
    };
  };
  const GjkAnswer quick = Gjk(core_of(first, first_at), core_of(second, second_at),
                              second_at.translation - first_at.translation);
  if (quick.apart) {
    const Eigen::Vector3d between = quick.p_second - quick.p_first;
    const double length = between.norm();
    if (length - quick.distance_m < kQuickCertainty_m) {
      const Eigen::Vector3d n = between / length;
      return {quick.distance_m - first.radius() - second.radius(),
              quick.p_first + first.radius() * n, quick.p_second - second.radius() * n, n};
    }
  }
  std::optional<Separation> best;
  // On round bodies FCL sometimes stops early; its other solver, or the other order, then does not.
  for (int attempt = 0; attempt < 3; ++attempt) {
    const fcl::GJKSolverType solver = attempt == 2 ? fcl::GST_INDEP : fcl::GST_LIBCCD;
    Nearest nearest = attempt == 1 ? AskFcl(second, second_at, first, first_at, solver)
                                   : AskFcl(first, first_at, second, second_at, solver);
    if (attempt == 1) std::swap(nearest.p_first, nearest.p_second);
    if (!nearest.apart) {
      if (attempt == 0) break;
      continue;
    }
    const Eigen::Vector3d between = nearest.p_second - nearest.p_first;
    const double length = between.norm();
    const Eigen::Vector3d n = between / length;
    // The bodies lie on either side of the planes at the answer: that much room is certain.
    const Separation certain = Along(n, first, first_at, second, second_at);
    const double claimed = length - first.radius() - second.radius();
    if (claimed - certain.distance_m < kCertainty_m) {
      return {certain.distance_m, nearest.p_first + first.radius() * n,
              nearest.p_second - second.radius() * n, n};
    }
    if (!best || certain.distance_m > best->distance_m) best = certain;
  }
  const Separation other = Penetration(first, first_at, second, second_at);
  return best && best->distance_m > other.distance_m ? *best : other;
}

}  // namespace

double Distance(const Bounds& a, const Bounds& b) {
  const Eigen::Vector3d gap =
      (a.lower - b.upper).cwiseMax(b.lower - a.upper).cwiseMax(Eigen::Vector3d::Zero());
  return gap.norm();
}

Result<ConvexShape> ConvexShape::Create(const kinematics::Shape& shape) {
  ConvexShape out;
  const auto fcl = std::make_shared<Fcl>();
  if (const auto* box = std::get_if<kinematics::Box>(&shape)) {
    for (int i = 0; i < 3; ++i) {
      if (!IsPositive(box->size[i])) return BadSize("box", "an edge", box->size[i]);
    }
    out.core_ = Core::kBox;
    out.half_ = 0.5 * box->size;
    fcl->core = std::make_shared<fcl::Boxd>(box->size.x(), box->size.y(), box->size.z());
    fcl->whole = fcl->core;
  } else if (const auto* sphere = std::get_if<kinematics::Sphere>(&shape)) {
    if (!IsPositive(sphere->radius)) return BadSize("sphere", "radius", sphere->radius);
    out.core_ = Core::kPoint;
    out.radius_ = sphere->radius;
    fcl->core = std::make_shared<fcl::Sphered>(0.0);
    fcl->whole = std::make_shared<fcl::Sphered>(sphere->radius);
  } else if (const auto* cylinder = std::get_if<kinematics::Cylinder>(&shape)) {
    if (!IsPositive(cylinder->radius)) return BadSize("cylinder", "radius", cylinder->radius);
    if (!IsPositive(cylinder->length)) return BadSize("cylinder", "length", cylinder->length);
    out.core_ = Core::kCylinder;
    out.half_ = {cylinder->radius, cylinder->radius, 0.5 * cylinder->length};
    fcl->core = std::make_shared<fcl::Cylinderd>(cylinder->radius, cylinder->length);
    fcl->whole = fcl->core;
  } else if (const auto* capsule = std::get_if<kinematics::Capsule>(&shape)) {
    if (!IsPositive(capsule->radius)) return BadSize("capsule", "radius", capsule->radius);
    if (!IsPositive(capsule->length)) return BadSize("capsule", "length", capsule->length);
    out.core_ = Core::kSegment;
    out.radius_ = capsule->radius;
    out.half_ = {0, 0, 0.5 * capsule->length};
    fcl->core = std::make_shared<fcl::Capsuled>(0.0, capsule->length);
    fcl->whole = std::make_shared<fcl::Capsuled>(capsule->radius, capsule->length);
  } else {
    return InvalidArgument("a mesh is not convex by itself");
  }
  out.Keep(fcl);
  return out;
}

Result<ConvexShape> ConvexShape::OfPoints(std::span<const Eigen::Vector3d> points) {
  const double share = points.size() > kManyPoints ? kRoughHullShare : kFineHullShare;
  Result<Hull> hull = ConvexHull(points, share);
  if (!hull.ok()) return hull.error();
  // Indices of the corners, as FCL takes them: each face begins with their number.
  const auto counted = std::make_shared<std::vector<int>>();
  const auto faces = std::make_shared<std::vector<int>>();
  for (const std::array<int, 3>& face : hull->faces) {
    counted->insert(counted->end(), {3, face[0], face[1], face[2]});
    faces->insert(faces->end(), face.begin(), face.end());
  }
  const auto vertices =
      std::make_shared<const std::vector<Eigen::Vector3d>>(std::move(hull->vertices));
  Eigen::Vector3d lower = vertices->front();
  Eigen::Vector3d upper = lower;
  for (const Eigen::Vector3d& vertex : *vertices) {
    lower = lower.cwiseMin(vertex);
    upper = upper.cwiseMax(vertex);
  }
  ConvexShape out;
  out.core_ = Core::kHull;
  out.vertices_ = vertices;
  out.faces_ = faces;
  out.centre_ = 0.5 * (lower + upper);
  out.half_ = 0.5 * (upper - lower);
  if (share > kFineHullShare) out.radius_ = share * hull->cloud_size;
  const auto fcl = std::make_shared<Fcl>();
  fcl->core =
      std::make_shared<fcl::Convexd>(vertices, static_cast<int>(hull->faces.size()), counted);
  fcl->whole = fcl->core;
  out.Keep(fcl);
  return out;
}

void ConvexShape::Keep(const std::shared_ptr<Fcl>& fcl) {
  // FCL reads the local bounds in const queries but computes them only when told.
  for (const auto& geometry : {fcl->core, fcl->whole}) {
    std::const_pointer_cast<fcl::CollisionGeometryd>(geometry)->computeLocalAABB();
  }
  fcl_ = fcl;
}

Eigen::Vector3d ConvexShape::Support(const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d point = CoreSupport(direction);
  const double length = direction.norm();
  return radius_ > 0 && length > 0 ? point + radius_ / length * direction : point;
}

Eigen::Vector3d ConvexShape::CoreSupport(const Eigen::Vector3d& direction) const {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  switch (core_) {
    case Core::kPoint:
      break;
    case Core::kSegment:
      point.z() = direction.z() < 0 ? -half_.z() : half_.z();
      break;
    case Core::kBox:
      for (int i = 0; i < 3; ++i) point[i] = direction[i] < 0 ? -half_[i] : half_[i];
      break;
    case Core::kCylinder: {
      const double across = direction.head<2>().norm();
      if (across > 1e-15) point.head<2>() = half_.x() / across * direction.head<2>();
      point.z() = direction.z() < 0 ? -half_.z() : half_.z();
      break;
    }
    case Core::kHull: {
      double best = -std::numeric_limits<double>::infinity();
      for (const Eigen::Vector3d& vertex : *vertices_) {
        const double along = vertex.dot(direction);
        if (along > best) {
          best = along;
          point = vertex;
        }
      }
      break;
    }
  }
  return point;
}

Bounds ConvexShape::BoundsAt(const Placement& at) const {
  Eigen::Vector3d extent;
  if (core_ == Core::kCylinder) {
    for (int i = 0; i < 3; ++i) {
      const double along = at.rotation(i, 2);
      extent[i] =
          half_.z() * std::abs(along) + half_.x() * std::sqrt(std::max(0.0, 1 - along * along));
    }
  } else {
    extent = at.rotation.cwiseAbs() * half_;
  }
  extent.array() += radius_;
  const Eigen::Vector3d centre = at * centre_;
  return {centre - extent, centre + extent};
}

double ConvexShape::reach() const {
  if (core_ == Core::kHull) {
    double farthest = 0;
    for (const Eigen::Vector3d& vertex : *vertices_) farthest = std::max(farthest, vertex.norm());
    return farthest + radius_;
  }
  if (core_ == Core::kCylinder) return std::hypot(half_.x(), half_.z());
  return half_.norm() + radius_;
}

Separation SignedDistance(const ConvexShape& first, const Placement& first_at,
                          const ConvexShape& second, const Placement& second_at) {
  const auto is_round = [](Core core) { return core == Core::kPoint || core == Core::kSegment; };
  const auto is_solid = [](Core core) { return core == Core::kBox || core == Core::kCylinder; };
  if (is_round(first.core()) && is_round(second.core())) {
    const Eigen::Vector3d u1 = first_at.rotation.col(2);
    const Eigen::Vector3d u2 = second_at.rotation.col(2);
    Eigen::Vector3d p1;
    Eigen::Vector3d p2;
    NearestOfSegments(first_at.translation, u1, first.half().z(), second_at.translation, u2,
                      second.half().z(), p1, p2);
    const Eigen::Vector3d across = u1.cross(u2);
    const Eigen::Vector3d normal =
        across.norm() > 1e-9 ? Eigen::Vector3d(across.normalized()) : u1.unitOrthogonal();
    return BetweenCores(p1, first.radius(), p2, second.radius(), normal);
  }
  if (first.core() == Core::kPoint && is_solid(second.core())) {
    return PointAgainstSolid(first, first_at, second, second_at);
  }
  if (second.core() == Core::kPoint && is_solid(first.core())) {
    Separation found = PointAgainstSolid(second, second_at, first, first_at);
    std::swap(found.p_first, found.p_second);
    found.normal = -found.normal;
    return found;
  }
  return ByGjk(first, first_at, second, second_at);
}

}  // namespace exemplar::collision
