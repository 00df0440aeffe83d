#pragma once
// Pose inverse kinematics: one pose, one answer within limits.

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "exemplar/base/result.hpp"
#include "exemplar/kinematics/chain.hpp"
#include "exemplar/kinematics/posture_cost.hpp"

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
  /// What else makes a posture good, beside `preferred`: descended along the null space once the
  /// pose is met, to a local minimum.
  PostureCost posture = {};
  /// So far off along each axis of the goal's frame the tool may be, beside the tolerances above;
  /// infinity leaves the axis free. Rotations are the components of the rotation vector from the
  /// goal to the tool.
  Eigen::Vector3d position_slack_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d rotation_slack_rad = Eigen::Vector3d::Zero();
  /// Instead of the goal's rotation: the tool's z axis points at this place, in the base frame.
  std::optional<Eigen::Vector3d> point_at = std::nullopt;
  int max_null_space_iterations = 60;  ///< towards `preferred`; 1 or 2 follow a moving pose
  int max_iterations = 100;            ///< of one descent; one that makes no headway ends sooner
  int max_restarts = 100;              ///< from random postures, after the seed
  std::uint64_t random_seed = 1;
};

struct IkSolution {
  Eigen::VectorXd q;
  double position_error_m = 0;    ///< beyond the slack
  double rotation_error_rad = 0;  ///< of what counts: beyond the slack, without a free roll
  int iterations = 0;
  int restarts = 0;
};

/// A bounded Levenberg-Marquardt descent with restarts: limits are active bounds, never clamped
/// afterwards (a seed outside them starts at the nearest posture within). Deterministic for a seed.
/// kFailedPrecondition with the best errors reached when the pose is not met; kInvalidArgument for
/// a pose, seed, slack or place to point at that is not finite, or a negative slack. Precondition:
/// seed.size() == chain.dof().
Result<IkSolution> SolveIk(const Chain& chain, const geometry::Pose& base_T_tool,
                           const Eigen::Ref<const Eigen::VectorXd>& seed,
                           const IkOptions& options = {});

}  // namespace exemplar::kinematics
