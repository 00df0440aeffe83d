#include "spline.hpp"

#include <algorithm>
#include <cassert>

namespace exemplar::motion {

PathSpline::PathSpline(std::span<const double> time_s,
                       const Eigen::Ref<const Eigen::MatrixXd>& values)
    : time_s_(time_s.begin(), time_s.end()), values_(values) {
  const auto n = static_cast<Eigen::Index>(time_s_.size());
  assert(n >= 2 && values.rows() == n);
  seconds_ = Eigen::MatrixXd::Zero(n, values.cols());
  if (n == 2) return;
  // Thomas' algorithm on the tridiagonal system of the natural spline.
  Eigen::VectorXd upper = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    const double before = time_s_[i] - time_s_[i - 1];
    const double after = time_s_[i + 1] - time_s_[i];
    const double diagonal = 2 * (before + after) - before * upper[i - 1];
    upper[i] = after / diagonal;
    seconds_.row(i) = (6 * ((values_.row(i + 1) - values_.row(i)) / after -
                            (values_.row(i) - values_.row(i - 1)) / before) -
                       before * seconds_.row(i - 1)) /
                      diagonal;
  }
  for (Eigen::Index i = n - 2; i >= 1; --i) seconds_.row(i) -= upper[i] * seconds_.row(i + 1);
}

PathSpline::Point PathSpline::At(double time_s) const {
  const auto after = std::upper_bound(time_s_.begin() + 1, time_s_.end() - 1, time_s);
  const auto i = static_cast<Eigen::Index>(after - time_s_.begin()) - 1;
  const double h = time_s_[i + 1] - time_s_[i];
  const double b = std::clamp((time_s - time_s_[i]) / h, 0.0, 1.0);
  const double a = 1 - b;
  const auto s0 = seconds_.row(i).transpose();
  const auto s1 = seconds_.row(i + 1).transpose();
  const auto v0 = values_.row(i).transpose();
  const auto v1 = values_.row(i + 1).transpose();
  Point point;
  point.value = a * v0 + b * v1 + h * h / 6 * ((a * a * a - a) * s0 + (b * b * b - b) * s1);
  point.first = (v1 - v0) / h + h / 6 * ((3 * b * b - 1) * s1 - (3 * a * a - 1) * s0);
  point.second = a * s0 + b * s1;
  return point;
}

}  // namespace exemplar::motion
