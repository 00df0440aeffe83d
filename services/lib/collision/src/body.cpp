#include "body.hpp"

#include <algorithm>
#include <cmath>

#include "exemplar/base/text.hpp"
#include "mesh_file.hpp"
#include "octree.hpp"
#include "solid_mesh.hpp"

namespace exemplar::collision {
namespace {

/// Dents that are not worth the exact surface.
constexpr double kShallow_m = 1e-4;
constexpr double kShallowShare = 1e-3;
/// Beyond so many comparisons of corners and faces the hull is not asked.
constexpr std::size_t kMostComparisons = 50'000'000;

struct Plane {
  Eigen::Vector3d normal;
  double offset = 0;
};

bool FillsItsHull(const SolidMesh& mesh, const ConvexShape& hull) {
  const std::span<const Eigen::Vector3d> vertices = hull.vertices();
  const std::span<const int> faces = hull.faces();
  if (faces.size() * mesh.triangles.size() > kMostComparisons) return false;
  std::vector<Plane> planes;
  double volume = 0;
  for (std::size_t i = 0; i < faces.size(); i += 3) {
    const Eigen::Vector3d& a = vertices[faces[i]];
    const Eigen::Vector3d across = (vertices[faces[i + 1]] - a).cross(vertices[faces[i + 2]] - a);
    volume += across.dot(a - vertices.front()) / 6;
    if (across.norm() > 0) planes.push_back({across.normalized(), across.normalized().dot(a)});
  }
  if (mesh.volume_m3 < (1 - kShallowShare) * volume) return false;
  const auto is_outside = [&](const Eigen::Vector3d& p) {
    return std::any_of(planes.begin(), planes.end(), [&](const Plane& plane) {
      return plane.normal.dot(p) > plane.offset - kShallow_m;
    });
  };
  return std::all_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const Triangle& triangle) {
    return std::all_of(triangle.begin(), triangle.end(), is_outside);
  });
}

Result<Body> MakeMeshBody(const kinematics::Mesh& mesh) {
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(mesh.scale[i]) || mesh.scale[i] == 0) {
      return InvalidArgument(mesh.path + ": mesh scale is " + FormatDouble(mesh.scale[i]) +
                             ", must not be zero");
    }
  }
  Result<std::vector<Eigen::Vector3d>> corners = ReadStl(mesh.path);
  if (!corners.ok()) return corners.error();
  for (Eigen::Vector3d& corner : *corners) corner = corner.cwiseProduct(mesh.scale);
  Result<ConvexShape> hull = ConvexShape::OfPoints(*corners);
  if (!hull.ok()) return WithPlace(hull.error(), mesh.path);
  if (mesh.convex) return Body{*std::move(hull), nullptr};
  Result<SolidMesh> solid = MakeSolidMesh(*corners);
  if (!solid.ok()) return WithPlace(solid.error(), mesh.path);
  if (FillsItsHull(*solid, *hull)) return Body{*std::move(hull), nullptr};
  return Body{*std::move(hull),
              Pieces::OfMesh(std::move(solid->triangles), std::move(solid->shell_points))};
}

}  // namespace

Result<Body> MakeBody(const kinematics::Shape& shape) {
  if (const auto* mesh = std::get_if<kinematics::Mesh>(&shape)) return MakeMeshBody(*mesh);
  Result<ConvexShape> convex = ConvexShape::Create(shape);
  if (!convex.ok()) return convex.error();
  return Body{*std::move(convex), nullptr};
}

Result<Body> MakeCloudBody(std::span<const Eigen::Vector3d> points, double resolution_m) {
  if (points.empty()) return InvalidArgument("the point cloud is empty");
  Result<std::vector<Bounds>> cells = OctreeCells(points, resolution_m);
  if (!cells.ok()) return cells.error();
  std::vector<Eigen::Vector3d> corners;
  for (const Bounds& cell : *cells) {
    for (int corner = 0; corner < 8; ++corner) {
      corners.emplace_back((corner & 1) != 0 ? cell.upper.x() : cell.lower.x(),
                           (corner & 2) != 0 ? cell.upper.y() : cell.lower.y(),
                           (corner & 4) != 0 ? cell.upper.z() : cell.lower.z());
    }
  }
  Result<ConvexShape> hull = ConvexShape::OfPoints(corners);
  if (!hull.ok()) return hull.error();
  return Body{*std::move(hull), Pieces::OfCells(*std::move(cells))};
}

Separation Distance(const Body& first, const Placement& first_at, const Body& second,
                    const Placement& second_at, double ignore_beyond_m) {
  const Separation hulls = SignedDistance(first.hull, first_at, second.hull, second_at);
  if (!first.pieces && !second.pieces) return hulls;
  if (hulls.distance_m >= ignore_beyond_m) return hulls;
  return DistanceOfPieces({first.hull, first.pieces.get(), first_at},
                          {second.hull, second.pieces.get(), second_at}, ignore_beyond_m);
}

}  // namespace exemplar::collision
