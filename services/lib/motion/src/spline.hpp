#pragma once
// A natural cubic spline through a path's frames: twice continuously differentiable.

#include <Eigen/Core>
#include <span>
#include <vector>

namespace exemplar::motion {

class PathSpline {
 public:
  /// `time_s` ascending (at least two), `values` one row a knot.
  PathSpline(std::span<const double> time_s, const Eigen::Ref<const Eigen::MatrixXd>& values);

  struct Point {
    Eigen::VectorXd value, first, second;  ///< and derivatives by time
  };
  Point At(double time_s) const;

 private:
  std::vector<double> time_s_;
  Eigen::MatrixXd values_;
  Eigen::MatrixXd seconds_;  ///< second derivatives at the knots
};

}  // namespace exemplar::motion
