#pragma once
// Pose inverse kinematics: one pose, one answer within limits.

#include <Eigen/Core>
#include <cstdint>

#include "exemplar/base/result.hpp"
#include "exemplar/kinematics/chain.hpp"

namespace exemplar::kinematics {

struct IkOptions {
  double position_tolerance_m = 1e-5;
  double rotation_tolerance_rad = 1e-5;
  bool use_rotation = true;     ///< false: position only
  bool free_tool_roll = false;  ///< true: the tool's z axis must point right, its turn is free
  /// The posture (dof values) to come as near to as the pose allows, by least squares along the
  /// null space; empty: none.
  Eigen::VectorXd preferred = {};
  /// What a squared radian (or metre) of each joint off `preferred` costs, positive; empty: 1 each.
  Eigen::VectorXd preferred_weights = {};
  int max_iterations = 100;  ///< of one descent; one that makes no headway ends sooner
  int max_restarts = 100;    ///< from random postures, after the seed
  std::uint64_t random_seed = 1;
};

struct IkSolution {
  Eigen::VectorXd q;
  double position_error_m = 0;
  double rotation_error_rad = 0;
  int iterations = 0;
  int restarts = 0;
};

/// A bounded Levenberg-Marquardt descent with restarts: limits are active bounds, never clamped
/// afterwards (a seed outside them starts at the nearest posture within). Deterministic for a seed.
/// kFailedPrecondition with the best errors reached when the pose is not met; kInvalidArgument for
/// a pose or seed that is not finite. Precondition: seed.size() == chain.dof().
Result<IkSolution> SolveIk(const Chain& chain, const geometry::Pose& base_T_tool,
                           const Eigen::Ref<const Eigen::VectorXd>& seed,
                           const IkOptions& options = {});

}  // namespace exemplar::kinematics
