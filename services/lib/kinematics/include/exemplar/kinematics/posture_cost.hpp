#pragma once
// What makes one posture better than another where the task leaves a choice.

#include <Eigen/Core>

#include "exemplar/kinematics/chain.hpp"

namespace exemplar::kinematics {

/// A sum of terms; those whose weight is 0 or whose vector is empty are left out.
struct PostureCost {
  /// Half the weighted squared distance to this posture (n), the demonstrated one for example.
  Eigen::VectorXd preferred = {};
  Eigen::VectorXd preferred_weights = {};  ///< n, positive; empty: 1 each
  /// Of the mean over the joints of u^2 / (1 - u^2) / 2, u from -1 to 1 between a joint's limits:
  /// flat in the middle, steep near the limits. Joints without limits have no part in it.
  double limits_weight = 0;
  /// Of minus the logarithm of the manipulability sqrt(det(J J')) (Yoshikawa 1985), with fewer than
  /// six joints sqrt(det(J' J)).
  double manipulability_weight = 0;
  /// Half (q - energy_from)' energy_metric (q - energy_from): with the inertia matrix as the
  /// metric, the kinetic energy of a move from there in one second.
  Eigen::VectorXd energy_from = {};
  Eigen::MatrixXd energy_metric = {};

  bool empty() const {
    return preferred.size() == 0 && limits_weight == 0 && manipulability_weight == 0 &&
           energy_from.size() == 0;
  }
};

/// The cost at q, strictly within limits where limits_weight is set. `gradient` (n) is exact, but
/// by central differences for the manipulability of chains with mimic joints; `curvature` (n) is
/// positive, about the diagonal of the Hessian: the metric for descents.
double EvaluatePostureCost(const Chain& chain, const PostureCost& cost,
                           const Eigen::Ref<const Eigen::VectorXd>& q,
                           Eigen::Ref<Eigen::VectorXd> gradient,
                           Eigen::Ref<Eigen::VectorXd> curvature);

}  // namespace exemplar::kinematics
