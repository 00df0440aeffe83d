#pragma once
// A motion that goes where its target will be, and how far it may be led away from there.

#include <Eigen/Core>
#include <vector>

#include "executor/following_target.hpp"
#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/motion/plan.hpp"

namespace exemplar::executor {

/// The path and, for each of its frames, what a correction needs. `frames` x `joints`.
struct FollowedPath {
  motion::JointTrajectory trajectory;
  Eigen::MatrixX3d base_p_object;          ///< where the target was taken to be at that time
  std::vector<Eigen::MatrixX3d> joints_m;  ///< joints that move the tool by 1 m along x, y, z
  std::vector<double> share;               ///< how much the path belongs to the target, 0 to 1
  Eigen::MatrixXd acceleration;            ///< of the joints, as planned, without sign
  /// The robot is proved to keep the clearance asked for, and this much more, while share > 0.
  double spare_m = 0;
};

/// When the motion belongs to its target, on its own time.
struct TargetTimes {
  double contact_s = 0;  ///< the tool meets it
  double release_s = 0;  ///< and leaves it

  /// 0 far from the contact, 1 at it, twice smooth.
  double ShareAt(double time_s) const;
  double begin_s() const;  ///< of a share above 0
  double end_s() const;
};

/// Fills in what follows from the trajectory and the target's `track`, the motion's time 0 being
/// `start` on the steady clock.
FollowedPath MakeFollowedPath(const kinematics::Chain& chain, motion::JointTrajectory trajectory,
                              const TargetTimes& times, const TargetTrack& track, Duration start);

/// From `path` to `fresh` and, after the release, back to the end of `first`: all three on one
/// time, but for `fresh`, which is `ahead_s` ahead of it. The change begins at `begin_s`; position,
/// speed and acceleration have no steps.
FollowedPath Blend(const kinematics::Chain& chain, const FollowedPath& path,
                   const FollowedPath& fresh, const motion::JointTrajectory& first, double ahead_s,
                   double begin_s, const TargetTimes& times);

/// Whether speeds and accelerations stay within the joints' limits from `begin_s` on.
bool KeepsLimits(const motion::JointTrajectory& trajectory,
                 const std::vector<kinematics::JointLimits>& limits, double begin_s);

/// Proves the clearance from `begin_s` on, and more of it while there is a share: false where it is
/// not kept at all; else spare_m is what was proved.
bool Prove(const kinematics::RobotDescription& robot, const collision::CollisionChecker& checker,
           const motion::PlannedMotion& plan, double required_clearance_m, double begin_s,
           const TargetTimes& times, FollowedPath& path);

}  // namespace exemplar::executor
