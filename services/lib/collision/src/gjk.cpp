#include "gjk.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace exemplar::collision {

/// The point nearest to the origin on a corner, edge or face of the simplex.
struct Simplex::Face {
  int size = 0;
  int index[3] = {0, 0, 0};
  double weight[3] = {1, 0, 0};
  Eigen::Vector3d nearest = Eigen::Vector3d::Zero();
};

void Simplex::Add(const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
  difference_[size_] = p - q;
  p_[size_] = p;
  q_[size_] = q;
  ++size_;
}

bool Simplex::Holds(const Eigen::Vector3d& difference) const {
  return std::any_of(difference_, difference_ + size_,
                     [&](const Eigen::Vector3d& d) { return d == difference; });
}

Simplex::Face Simplex::OnSegment(int a, int b) const {
  const Eigen::Vector3d ab = difference_[b] - difference_[a];
  const double squared = ab.squaredNorm();
  const double t = squared > 0 ? -difference_[a].dot(ab) / squared : 0;
  if (t <= 0) return {1, {a, 0, 0}, {1, 0, 0}, difference_[a]};
  if (t >= 1) return {1, {b, 0, 0}, {1, 0, 0}, difference_[b]};
  return {2, {a, b, 0}, {1 - t, t, 0}, difference_[a] + t * ab};
}

Simplex::Face Simplex::OnTriangle(int a, int b, int c) const {
  const Eigen::Vector3d& pa = difference_[a];
  const Eigen::Vector3d ab = difference_[b] - pa;
  const Eigen::Vector3d ac = difference_[c] - pa;
  const Eigen::Vector3d normal = ab.cross(ac);
  const double area = normal.squaredNorm();
  if (area > 1e-24 * ab.squaredNorm() * ac.squaredNorm()) {
    // Barycentric coordinates of the origin's projection.
    const double v = (-pa).cross(ac).dot(normal) / area;
    const double w = ab.cross(-pa).dot(normal) / area;
    if (v >= 0 && w >= 0 && v + w <= 1) {
      return {3, {a, b, c}, {1 - v - w, v, w}, normal * (pa.dot(normal) / area)};
    }
  }
  Face best = OnSegment(a, b);
  for (const Face& face : {OnSegment(a, c), OnSegment(b, c)}) {
    if (face.nearest.squaredNorm() < best.nearest.squaredNorm()) best = face;
  }
  return best;
}

void Simplex::Keep(const Face& face) {
  Eigen::Vector3d difference[3], p[3], q[3];
  for (int i = 0; i < face.size; ++i) {
    difference[i] = difference_[face.index[i]];
    p[i] = p_[face.index[i]];
    q[i] = q_[face.index[i]];
  }
  for (int i = 0; i < face.size; ++i) {
    difference_[i] = difference[i];
    p_[i] = p[i];
    q_[i] = q[i];
    weight_[i] = face.weight[i];
  }
  size_ = face.size;
  nearest_ = face.nearest;
}

bool Simplex::Reduce() {
  if (size_ == 1) {
    nearest_ = difference_[0];
    return true;
  }
  if (size_ == 2) {
    Keep(OnSegment(0, 1));
    return true;
  }
  if (size_ == 3) {
    Keep(OnTriangle(0, 1, 2));
    return true;
  }
  constexpr int kFaces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
  bool inside = true;
  Face best;
  for (const auto& [a, b, c, opposite] : kFaces) {
    const Eigen::Vector3d normal =
        (difference_[b] - difference_[a]).cross(difference_[c] - difference_[a]);
    const double origin_side = -difference_[a].dot(normal);
    const double height = (difference_[opposite] - difference_[a]).dot(normal);
    // A flat tetrahedron has no inside.
    const double flat = 1e-12 * normal.norm() * (difference_[opposite] - difference_[a]).norm();
    if (std::abs(height) > flat && origin_side * height >= 0) continue;
    inside = false;
    const Face face = OnTriangle(a, b, c);
    if (best.size == 0 || face.nearest.squaredNorm() < best.nearest.squaredNorm()) best = face;
  }
  if (inside) return false;
  Keep(best);
  return true;
}

Eigen::Vector3d Simplex::on_first() const {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int i = 0; i < size_; ++i) point += weight_[i] * p_[i];
  return point;
}

Eigen::Vector3d Simplex::on_second() const {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int i = 0; i < size_; ++i) point += weight_[i] * q_[i];
  return point;
}

}  // namespace exemplar::collision
