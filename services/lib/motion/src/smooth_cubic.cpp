#include "smooth_cubic.hpp"

#include <cassert>

namespace exemplar::motion {

void JoinSmoothly(JointTrajectory& trajectory) {
  const auto last = static_cast<Eigen::Index>(trajectory.time_s.size()) - 1;
  assert(last >= 4);
  Eigen::MatrixXd& p = trajectory.positions;
  Eigen::VectorXd h(last);
  for (Eigen::Index i = 0; i < last; ++i) {
    h[i] = trajectory.time_s[i + 1] - trajectory.time_s[i];
  }
  // A tridiagonal system for the accelerations between the ends, by Thomas' algorithm. From rest
  // the first piece leads to p0 + a1 h0^2 / 6, the last one comes from pn + a h^2 / 6.
  Eigen::VectorXd upper = Eigen::VectorXd::Zero(last);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(last + 1, p.cols());
  const double first_h2 = h[0] * h[0];
  const double last_h2 = h[last - 1] * h[last - 1];
  for (Eigen::Index i = 1; i < last; ++i) {
    double below = h[i - 1];
    double diagonal = 2 * (h[i - 1] + h[i]);
    double above = h[i];
    if (i == 1) diagonal += h[0] + first_h2 / h[1];
    if (i == 2) below -= first_h2 / h[1];
    if (i == last - 2) above -= last_h2 / h[i];
    if (i == last - 1) diagonal += h[i] + last_h2 / h[i - 1];
    const auto before = p.row(i == 2 ? 0 : i - 1);
    const auto after = p.row(i == last - 2 ? last : i + 1);
    const auto here = p.row(i == 1 ? 0 : i == last - 1 ? last : i);
    const double pivot = i == 1 ? diagonal : diagonal - below * upper[i - 1];
    upper[i] = above / pivot;
    a.row(i) = 6 * ((after - here) / h[i] - (here - before) / h[i - 1]) / pivot;
    if (i > 1) a.row(i) -= below / pivot * a.row(i - 1);
  }
  for (Eigen::Index i = last - 2; i >= 1; --i) a.row(i) -= upper[i] * a.row(i + 1);
  p.row(1) = p.row(0) + first_h2 / 6 * a.row(1);
  p.row(last - 1) = p.row(last) + last_h2 / 6 * a.row(last - 1);
  trajectory.velocities.setZero(last + 1, p.cols());
  for (Eigen::Index i = 1; i < last; ++i) {
    trajectory.velocities.row(i) =
        (p.row(i + 1) - p.row(i)) / h[i] - h[i] / 6 * (2 * a.row(i) + a.row(i + 1));
  }
}

}  // namespace exemplar::motion
