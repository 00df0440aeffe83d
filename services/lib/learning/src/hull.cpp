#include "hull.hpp"

#include <algorithm>
#include <cassert>

namespace exemplar::learning {

double DistanceFromHull(const Eigen::Ref<const Eigen::MatrixXd>& points,
                        const Eigen::Ref<const Eigen::VectorXd>& point) {
  assert(points.rows() > 0 && points.cols() == point.size());
  // Pairwise Frank-Wolfe (Lacoste-Julien & Jaggi 2015): move weight from the worst corner to the
  // best one.
  constexpr int kMaxSteps = 200;
  const Eigen::Index n = points.rows();
  const Eigen::MatrixXd offsets = points.rowwise() - point.transpose();
  const double extent = (offsets.colwise().maxCoeff() - offsets.colwise().minCoeff()).norm();
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(n);
  Eigen::Index nearest = 0;
  offsets.rowwise().squaredNorm().minCoeff(&nearest);
  weights[nearest] = 1;
  Eigen::VectorXd at = offsets.row(nearest).transpose();
  for (int step = 0; step < kMaxSteps; ++step) {
    const Eigen::VectorXd slope = offsets * at;
    Eigen::Index best = 0;
    slope.minCoeff(&best);
    Eigen::Index worst = best;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (weights[j] > 0 && slope[j] > slope[worst]) worst = j;
    }
    const double gap = slope[worst] - slope[best];
    if (gap <= 1e-6 * (extent * extent + at.squaredNorm())) break;
    const Eigen::VectorXd direction = (offsets.row(best) - offsets.row(worst)).transpose();
    const double length =
        std::clamp(-at.dot(direction) / direction.squaredNorm(), 0.0, weights[worst]);
    weights[best] += length;
    weights[worst] -= length;
    at += length * direction;
  }
  return at.norm();
}

}  // namespace exemplar::learning
