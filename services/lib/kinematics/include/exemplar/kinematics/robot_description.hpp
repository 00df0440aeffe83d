#pragma once
// A robot's folder (deploy/models/<robot>): robot.yaml beside its URDF, which says what a URDF
// cannot.
//
//   urdf: arm7.urdf
//   srdf: arm7.srdf       # optional: its disabled pairs of links are never checked for collision;
//                         # without it, pairs that touch in every one of many random states
//   convex_meshes: true   # optional: collision meshes are taken by their convex hulls, which fills
//                         # their hollows and lets open ones pass
//   base: base            # link in whose frame all poses are
//   tip: tool             # the frame that skills move
//   touch_links: [finger] # links that may touch what a skill is about
//   home: {joint1: 0.0, ...}                    # rad or m; every chain joint
//   acceleration: {default: 5.0, joint1: 3.0}   # rad/s^2
//   jerk: {default: 200.0, joint1: 100.0}           # rad/s^3
//   servo: {default: {stiffness: 400, damping: 40}, joint1: {...}}   # for the simulator
//   hand: {joint: left_finger, closed: 0, open: 0.04, force: 30, stiffness: 2000, damping: 60}
//                         # optional: a joint beside the chain that opens and closes a hand; force
//                         # (N or N m, default: the URDF's effort) is the most it presses with

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/kinematics/chain.hpp"
#include "exemplar/kinematics/robot_model.hpp"
#include "exemplar/kinematics/srdf.hpp"

namespace exemplar::kinematics {

struct ServoGains {
  double stiffness = 400;  ///< N m / rad
  double damping = 40;     ///< N m s / rad
};

struct RobotDescription {
  std::string name;
  std::filesystem::path folder;
  RobotModel model;
  Chain chain;  ///< base to tip
  std::vector<std::string>
      touch_links;                ///< empty in the file: the tip link's nearest link with geometry
  Eigen::VectorXd home;           ///< n = chain.dof()
  std::vector<ServoGains> servo;  ///< one a chain joint
  std::optional<LinkPairs> allowed_pairs = {};  ///< of the SRDF, where there is one
  ServoGains hand_servo = {};                   ///< of model.hand's joint, where there is one
  std::filesystem::path urdf = {};              ///< the file
};

/// Errors name file, line and key.
Result<RobotDescription> ReadRobotDescription(const std::filesystem::path& folder);

/// The model's full joint vector (as LinkPoses takes it) with the chain's joints at `q`, a hand
/// open, others at 0 or the limit nearest to 0.
Eigen::VectorXd FullJointVector(const RobotModel& model, const Chain& chain,
                                const Eigen::Ref<const Eigen::VectorXd>& q);

/// Puts the hand's joint, and what follows it by mimic, to an opening from 0 (closed) to 1 (open).
/// Does nothing without a hand; does not allocate.
void SetHandOpening(const RobotModel& model, double opening, Eigen::Ref<Eigen::VectorXd> full);

}  // namespace exemplar::kinematics
