#pragma once
// How fast a path may be run through.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "exemplar/kinematics/robot_model.hpp"
#include "exemplar/motion/plan.hpp"

namespace exemplar::motion {

/// Runs through `joints` (frames x n, at `time_s`, as demonstrated) no faster than demonstrated
/// times `speed_scale`, within velocity, acceleration and jerk limits, from rest to rest:
/// reachability analysis over the squared path speed (Pham & Pham 2018) with the demonstrated speed
/// as one more bound; then the path speed is smoothed, and slowed down where the jerk asks for it.
/// `frame_time_s` gets the new time of each frame. The limits hold everywhere on the cubic pieces
/// of the result, whose acceleration is continuous and zero at both ends.
JointTrajectory TimePath(std::span<const double> time_s,
                         const Eigen::Ref<const Eigen::MatrixXd>& joints,
                         const std::vector<std::string>& joint_names,
                         const std::vector<kinematics::JointLimits>& limits, double speed_scale,
                         std::vector<double>& frame_time_s);

/// From rest to rest along a straight line in joint space with the least jerk, within
/// `velocity_fraction` of the velocity limits, and the acceleration and jerk limits.
JointTrajectory TimeLine(const Eigen::Ref<const Eigen::VectorXd>& from,
                         const Eigen::Ref<const Eigen::VectorXd>& to,
                         const std::vector<std::string>& joint_names,
                         const std::vector<kinematics::JointLimits>& limits,
                         double velocity_fraction);

/// `second` after `first`. Precondition: they meet at rest in one posture.
JointTrajectory Concatenate(const JointTrajectory& first, const JointTrajectory& second);

/// The largest ratio of a velocity to its limit, of an acceleration and of a jerk, anywhere on the
/// cubic pieces.
struct LimitUse {
  double velocity = 0;
  double acceleration = 0;
  double jerk = 0;
};
LimitUse MeasureLimitUse(const JointTrajectory& trajectory,
                         const std::vector<kinematics::JointLimits>& limits);

/// Of any joint between neighbouring pieces, and against rest at both ends: where it is zero up to
/// rounding, the pieces' jerk is all that there is.
double LargestAccelerationJump(const JointTrajectory& trajectory);

}  // namespace exemplar::motion
