#pragma once
#include <Eigen/Core>

namespace exemplar::learning {

/// Distance of `point` (d) from the convex hull of `points` (n x d, n > 0), by Wolfe's
/// minimum-norm iteration (away steps), to about a thousandth of the hull's extent.
double DistanceFromHull(const Eigen::Ref<const Eigen::MatrixXd>& points,
                        const Eigen::Ref<const Eigen::VectorXd>& point);

}  // namespace exemplar::learning
