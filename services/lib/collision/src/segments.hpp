#pragma once
// Nearest points of line segments.

#include <Eigen/Core>
#include <algorithm>

namespace exemplar::collision {

/// Nearest points of two segments c ± h along unit axes (Ericson 2005, 5.1.9, in centred form).
inline void NearestOfSegments(const Eigen::Vector3d& c1, const Eigen::Vector3d& u1, double h1,
                              const Eigen::Vector3d& c2, const Eigen::Vector3d& u2, double h2,
                              Eigen::Vector3d& p1, Eigen::Vector3d& p2) {
  const Eigen::Vector3d r = c1 - c2;
  const double b = u1.dot(u2);
  const double d1 = u1.dot(r);
  const double d2 = u2.dot(r);
  const double determinant = 1 - b * b;
  double s = determinant > 1e-12 ? std::clamp((b * d2 - d1) / determinant, -h1, h1) : 0.0;
  double t = b * s + d2;
  if (t < -h2 || t > h2) {
    t = std::clamp(t, -h2, h2);
  }
  s = std::clamp(b * t - d1, -h1, h1);
  t = std::clamp(b * s + d2, -h2, h2);
  p1 = c1 + s * u1;
  p2 = c2 + t * u2;
}

}  // namespace exemplar::collision
