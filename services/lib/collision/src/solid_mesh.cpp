#include "solid_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <unordered_map>
#include <utility>

#include "exemplar/base/text.hpp"

namespace exemplar::collision {
namespace {

constexpr double kWeldShare = 1e-6;
/// Triangles thinner than this share of their longest edge have no area to speak of.
constexpr double kThin = 1e-9;

class Welder {
 public:
  explicit Welder(double tolerance) : tolerance_(tolerance) {}

  /// The index of the point, or of an earlier one within the tolerance.
  int Add(const Eigen::Vector3d& p) {
    const Eigen::Array3d scaled = p.array() / (4 * tolerance_);
    const Eigen::Array3d cell = scaled.floor();
    // Neighbours within the tolerance lie in this cell or, near its walls, in the next.
    for (int corner = 0; corner < 8; ++corner) {
      Eigen::Array3d at = cell;
      bool near = true;
      for (int i = 0; i < 3; ++i) {
        if ((corner >> i & 1) == 0) continue;
        const double inside = scaled[i] - cell[i];
        if (inside > 0.25 && inside < 0.75) near = false;
        at[i] += inside < 0.5 ? -1 : 1;
      }
      if (!near) continue;
      const auto [first, last] = cells_.equal_range(KeyOf(at));
      for (auto entry = first; entry != last; ++entry) {
        if ((points_[entry->second] - p).norm() <= tolerance_) return entry->second;
      }
    }
    const int index = static_cast<int>(points_.size());
    points_.push_back(p);
    cells_.emplace(KeyOf(cell), index);
    return index;
  }

  const std::vector<Eigen::Vector3d>& points() const { return points_; }

 private:
  static std::uint64_t KeyOf(const Eigen::Array3d& cell) {
    std::uint64_t key = 0;
    for (int i = 0; i < 3; ++i) {
      key = key * 0x9E3779B97F4A7C15ULL +
            static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[i]));
      key ^= key >> 29;
    }
    return key;
  }

  double tolerance_;
  std::vector<Eigen::Vector3d> points_;
  std::unordered_multimap<std::uint64_t, int> cells_;
};

std::string Written(const Eigen::Vector3d& p) {
  return "(" + FormatFixed(p.x(), 4) + ", " + FormatFixed(p.y(), 4) + ", " + FormatFixed(p.z(), 4) +
         ")";
}

}  // namespace

Result<SolidMesh> MakeSolidMesh(std::span<const Eigen::Vector3d> corners) {
  if (corners.size() < 3) return InvalidArgument("the mesh has no triangles");
  Eigen::Vector3d lower = corners.front();
  Eigen::Vector3d upper = lower;
  for (const Eigen::Vector3d& corner : corners) {
    lower = lower.cwiseMin(corner);
    upper = upper.cwiseMax(corner);
  }
  const double size = (upper - lower).norm();
  if (!(size > 0)) return InvalidArgument("all corners of the mesh are one point");
  Welder welder(kWeldShare * size);
  std::vector<std::array<int, 3>> faces;
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    const std::array<int, 3> face = {welder.Add(corners[i]), welder.Add(corners[i + 1]),
                                     welder.Add(corners[i + 2])};
    if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0]) faces.push_back(face);
  }
  const std::vector<Eigen::Vector3d>& points = welder.points();

  std::vector<int> shell(points.size());
  std::iota(shell.begin(), shell.end(), 0);
  const auto root_of = [&](int point) {
    while (shell[point] != point) point = shell[point] = shell[shell[point]];
    return point;
  };
  std::vector<std::pair<int, int>> edges;
  SolidMesh mesh;
  const Eigen::Vector3d middle = 0.5 * (lower + upper);
  double volume = 0;
  for (const std::array<int, 3>& face : faces) {
    for (int i = 0; i < 3; ++i) {
      edges.emplace_back(std::minmax(face[i], face[(i + 1) % 3]));
      shell[root_of(face[i])] = root_of(face[(i + 1) % 3]);
    }
    const Eigen::Vector3d a = points[face[0]];
    const Eigen::Vector3d b = points[face[1]];
    const Eigen::Vector3d c = points[face[2]];
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    volume += normal.dot(a - middle) / 6;
    const double longest =
        std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()});
    if (normal.norm() > kThin * longest) mesh.triangles.push_back({a, b, c});
  }
  if (mesh.triangles.empty()) return InvalidArgument("no triangle of the mesh has an area");
  std::sort(edges.begin(), edges.end());
  int open = 0;
  std::pair<int, int> open_edge;
  for (std::size_t i = 0; i < edges.size();) {
    const std::size_t begin = i;
    while (i < edges.size() && edges[i] == edges[begin]) ++i;
    if ((i - begin) % 2 == 0) continue;
    if (open++ == 0) open_edge = edges[begin];
  }
  if (open > 0) {
    return InvalidArgument(
        "the mesh is open: " + std::to_string(open) + (open == 1 ? " edge has" : " edges have") +
        " a triangle on one side only, the first from " + Written(points[open_edge.first]) +
        " to " + Written(points[open_edge.second]) +
        "; close it, or have it taken by its convex hull (convex: true)");
  }
  for (const std::array<int, 3>& face : faces) {
    mesh.shell_points.push_back(points[root_of(face[0])]);
  }
  std::sort(mesh.shell_points.begin(), mesh.shell_points.end(),
            [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
              return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
            });
  mesh.shell_points.erase(std::unique(mesh.shell_points.begin(), mesh.shell_points.end()),
                          mesh.shell_points.end());
  mesh.volume_m3 = std::abs(volume);
  return mesh;
}

}  // namespace exemplar::collision
