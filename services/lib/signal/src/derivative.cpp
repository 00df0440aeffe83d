#include "exemplar/signal/derivative.hpp"

#include <cassert>

namespace exemplar::signal {

Eigen::MatrixXd Derivative(const Eigen::Ref<const Eigen::MatrixXd>& samples, double step_s) {
  assert(step_s > 0);
  const Eigen::Index n = samples.rows();
  Eigen::MatrixXd rate = Eigen::MatrixXd::Zero(n, samples.cols());
  if (n < 2) return rate;
  if (n == 2) {
    rate.rowwise() = (samples.row(1) - samples.row(0)) / step_s;
    return rate;
  }
  rate.middleRows(1, n - 2) = (samples.bottomRows(n - 2) - samples.topRows(n - 2)) / (2 * step_s);
  rate.row(0) = (-3 * samples.row(0) + 4 * samples.row(1) - samples.row(2)) / (2 * step_s);
  rate.row(n - 1) =
      (3 * samples.row(n - 1) - 4 * samples.row(n - 2) + samples.row(n - 3)) / (2 * step_s);
  return rate;
}

}  // namespace exemplar::signal
