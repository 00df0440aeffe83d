#include "convex_hull.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

namespace exemplar::collision {
namespace {

struct Face {
  std::array<int, 3> corners{};
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset = 0;
  std::vector<int> outside;  ///< points above this face and above no earlier one
  bool alive = true;

  double Height(const Eigen::Vector3d& p) const { return normal.dot(p) - offset; }
};

class Builder {
 public:
  Builder(std::span<const Eigen::Vector3d> points, double tolerance)
      : points_(points), tolerance_(tolerance) {}

  void Start(const std::array<int, 4>& tetrahedron) {
    inside_ = Eigen::Vector3d::Zero();
    for (const int i : tetrahedron) inside_ += 0.25 * points_[i];
    for (int skip = 0; skip < 4; ++skip) {
      std::array<int, 3> corners{};
      int n = 0;
      for (int i = 0; i < 4; ++i) {
        if (i != skip) corners[n++] = tetrahedron[i];
      }
      AddFace(corners);
    }
    std::vector<int> all(points_.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
    Distribute(all, 0);
  }

  void Grow() {
    for (std::size_t at = 0; at < faces_.size(); ++at) {
      while (faces_[at].alive && !faces_[at].outside.empty()) AddPoint(Farthest(faces_[at]));
    }
  }

  Hull Take() const {
    Hull hull;
    std::map<int, int> index;
    for (const Face& face : faces_) {
      if (!face.alive) continue;
      std::array<int, 3> corners{};
      for (int i = 0; i < 3; ++i) {
        const auto [entry, added] =
            index.try_emplace(face.corners[i], static_cast<int>(hull.vertices.size()));
        if (added) hull.vertices.push_back(points_[face.corners[i]]);
        corners[i] = entry->second;
      }
      hull.faces.push_back(corners);
    }
    return hull;
  }

 private:
  void AddFace(std::array<int, 3> corners) {
    Face face;
    face.normal = (points_[corners[1]] - points_[corners[0]])
                      .cross(points_[corners[2]] - points_[corners[0]]);
    const double length = face.normal.norm();
    if (length > 0) face.normal /= length;
    face.offset = face.normal.dot(points_[corners[0]]);
    if (face.Height(inside_) > 0) {
      std::swap(corners[1], corners[2]);
      face.normal = -face.normal;
      face.offset = -face.offset;
    }
    face.corners = corners;
    faces_.push_back(std::move(face));
  }

  void Distribute(const std::vector<int>& candidates, std::size_t first_face) {
    for (const int point : candidates) {
      for (std::size_t f = first_face; f < faces_.size(); ++f) {
        if (faces_[f].alive && faces_[f].Height(points_[point]) > tolerance_) {
          faces_[f].outside.push_back(point);
          break;
        }
      }
    }
  }

  int Farthest(const Face& face) const {
    return *std::max_element(face.outside.begin(), face.outside.end(), [&](int a, int b) {
      return face.Height(points_[a]) < face.Height(points_[b]);
    });
  }

  void AddPoint(int point) {
    // The horizon: edges between a face that sees the point and one that does not.
    std::map<std::pair<int, int>, bool> edges;
    std::vector<int> orphans;
    for (Face& face : faces_) {
      if (!face.alive || face.Height(points_[point]) <= tolerance_) continue;
      face.alive = false;
      for (int i = 0; i < 3; ++i) edges[{face.corners[i], face.corners[(i + 1) % 3]}] = true;
      for (const int orphan : face.outside) {
        if (orphan != point) orphans.push_back(orphan);
      }
      face.outside.clear();
    }
    const std::size_t first_new = faces_.size();
    for (const auto& [edge, seen] : edges) {
      if (!edges.contains({edge.second, edge.first})) AddFace({edge.first, edge.second, point});
    }
    Distribute(orphans, first_new);
  }

  std::span<const Eigen::Vector3d> points_;
  double tolerance_;
  Eigen::Vector3d inside_ = Eigen::Vector3d::Zero();
  std::vector<Face> faces_;
};

template <class Score>
int Best(std::span<const Eigen::Vector3d> points, Score score) {
  int best = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (score(points[i]) > score(points[best])) best = static_cast<int>(i);
  }
  return best;
}

}  // namespace

Result<Hull> ConvexHull(std::span<const Eigen::Vector3d> points, double tolerance_share) {
  const Error flat = InvalidArgument("the points span no volume");
  if (points.size() < 4) return flat;
  const int a = Best(points, [](const Eigen::Vector3d& p) { return -p.x(); });
  const int b =
      Best(points, [&](const Eigen::Vector3d& p) { return (p - points[a]).squaredNorm(); });
  const double size = (points[b] - points[a]).norm();
  if (!(size > 0)) return flat;
  const Eigen::Vector3d line = (points[b] - points[a]) / size;
  const int c =
      Best(points, [&](const Eigen::Vector3d& p) { return (p - points[a]).cross(line).norm(); });
  Eigen::Vector3d normal = (points[c] - points[a]).cross(line);
  if (normal.norm() < 1e-7 * size) return flat;
  normal.normalize();
  const int d =
      Best(points, [&](const Eigen::Vector3d& p) { return std::abs(normal.dot(p - points[a])); });
  if (std::abs(normal.dot(points[d] - points[a])) < 1e-7 * size) return flat;
  Builder builder(points, tolerance_share * size);
  builder.Start({a, b, c, d});
  builder.Grow();
  Hull hull = builder.Take();
  hull.cloud_size = size;
  return hull;
}

}  // namespace exemplar::collision
