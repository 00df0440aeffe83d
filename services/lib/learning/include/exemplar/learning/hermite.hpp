#pragma once
#include <span>
#include <vector>

namespace exemplar::learning {

/// Tangents of the monotone cubic through (x_k, y_k): means of the neighbouring slopes, limited in
/// ascending order so that no stretch overshoots (Fritsch & Carlson 1980; PAPER.md section 4).
/// Precondition: at least two knots, x strictly increasing, y not decreasing.
std::vector<double> MonotoneTangents(std::span<const double> x, std::span<const double> y);

/// One stretch of a cubic Hermite spline, s in [0, 1] along it; `width` is its extent in x.
inline double HermiteValue(double y0, double y1, double m0, double m1, double width, double s) {
  const double r = 1 - s;
  return r * r * ((1 + 2 * s) * y0 + s * width * m0) + s * s * ((1 + 2 * r) * y1 - r * width * m1);
}

/// A monotone warp of time. Immutable.
class MonotoneHermite {
 public:
  /// Precondition: as MonotoneTangents.
  MonotoneHermite(std::vector<double> x, std::vector<double> y);

  /// Held before the first and after the last knot.
  double operator()(double x) const;
  const std::vector<double>& tangents() const { return tangents_; }

 private:
  std::vector<double> x_, y_, tangents_;
};

}  // namespace exemplar::learning
