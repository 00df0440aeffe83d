#pragma once
// A motion that goes where its target will be, and how far it may be led away from there.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "executor/following_target.hpp"
#include "executor/guard.hpp"
#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/motion/plan.hpp"

namespace exemplar::executor {

/// A press of the target that ends by touch: then the tool goes back out, and stays there until the
/// plan's way out comes by.
struct TargetPress {
  Eigen::Vector3d base_inward = Eigen::Vector3d::Zero();       ///< unit
  Eigen::Vector3d object_p_contact = Eigen::Vector3d::Zero();  ///< base axes
  double first_depth_m = 0;  ///< a touch counts from here on, past the contact
  double lift_m = 0;         ///< so far it goes back out
};

/// The path and, for each of its frames, what a correction needs. `frames` x `joints`.
struct FollowedPath {
  motion::JointTrajectory trajectory;
  Eigen::MatrixX3d base_p_object;          ///< where the target was taken to be at that time
  std::vector<Eigen::MatrixX3d> joints_m;  ///< joints that move the tool by 1 m along x, y, z
  std::vector<double> share;               ///< how much the path belongs to the target, 0 to 1
  Eigen::MatrixXd acceleration;            ///< of the joints, as planned, without sign
  std::vector<double> depth_m = {};        ///< of the tool past the contact; empty: no TargetPress
  /// The robot is proved to keep the clearance asked for, and this much more, while share > 0,
  /// wherever a touch sends it back out.
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
/// `start` on the steady clock. `press`: null where it ends by position.
FollowedPath MakeFollowedPath(const kinematics::Chain& chain, motion::JointTrajectory trajectory,
                              const TargetTimes& times, const TargetTrack& track, Duration start,
                              const TargetPress* press);

/// From `path` to `fresh` and, after the release, back to the end of `first`: all three on one
/// time, but for `fresh`, which is `ahead_s` ahead of it. The change begins at `begin_s`; position,
/// speed and acceleration have no steps.
FollowedPath Blend(const kinematics::Chain& chain, const FollowedPath& path,
                   const FollowedPath& fresh, const motion::JointTrajectory& first, double ahead_s,
                   double begin_s, const TargetTimes& times, const TargetPress* press);

/// Where a touch ends the press of a path that has depths; nullopt where it does not come near.
std::optional<GuardZone> ZoneOf(const FollowedPath& path, const TargetPress& press,
                                const TargetTimes& times);

/// Whether speeds and accelerations stay within the joints' limits from `begin_s` on.
bool KeepsLimits(const motion::JointTrajectory& trajectory,
                 const std::vector<kinematics::JointLimits>& limits, double begin_s);

/// Proves the clearance from `begin_s` on, and more of it while there is a share: false where it is
/// not kept at all; else spare_m is what was proved.
bool Prove(const kinematics::RobotDescription& robot, const collision::CollisionChecker& checker,
           const motion::PlannedMotion& plan, double required_clearance_m, double begin_s,
           const TargetTimes& times, const TargetPress* press, FollowedPath& path);

}  // namespace exemplar::executor
