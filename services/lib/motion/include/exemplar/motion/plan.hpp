#pragma once
// A skill's motion and a scene in, a checked and timed joint trajectory out.

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/collision/scene.hpp"
#include "exemplar/demonstration/motion.hpp"
#include "exemplar/kinematics/chain.hpp"
#include "exemplar/motion/carry.hpp"
#include "exemplar/motion/path_ik.hpp"

namespace exemplar::motion {

/// Joint positions over time. Invariant: time starts at 0 and increases strictly.
struct JointTrajectory {
  std::vector<std::string> joint_names;
  std::vector<double> time_s;
  Eigen::MatrixXd positions;           ///< frames x joints
  Eigen::MatrixXd velocities;          ///< frames x joints
  std::vector<double> hand_open = {};  ///< one a frame, from 0 (closed) to 1 (open), or empty

  double duration_s() const { return time_s.empty() ? 0.0 : time_s.back(); }
};

/// Position and velocity at `time_s` (held before the first and after the last frame), cubic
/// between frames. Does not allocate. `position` and `velocity` have the trajectory's number of
/// joints.
void Evaluate(const JointTrajectory& trajectory, double time_s,
              Eigen::Ref<Eigen::VectorXd> position, Eigen::Ref<Eigen::VectorXd> velocity);

/// The hand's opening at `time_s`, linear between frames, held outside. Precondition: there is one.
double EvaluateHand(const JointTrajectory& trajectory, double time_s);

struct PlanOptions {
  double position_tolerance_m = 1e-4;  ///< in contact; elsewhere `free_tolerance_m`
  double free_tolerance_m = 5e-3;
  double rotation_tolerance_rad = 2e-2;
  double required_clearance_m = 2e-3;
  double speed_scale = 1.0;  ///< 1: the demonstrated timing where limits allow
  double approach_velocity =
      0.5;  ///< fraction of joint velocity limits on the way to the first frame
  /// Links that may touch the target of a contact, from `touch_margin_m` of tool path before the
  /// contact to as much after it; empty: the tip link.
  std::vector<std::string> touch_links = {};
  double touch_margin_m = 0.03;
  /// What joints tend to where the skill has no joints of the chain (n = chain.dof()); empty:
  /// mid-range.
  Eigen::VectorXd comfortable = {};
  PathIkVariant inverse_kinematics = PathIkVariant::kExemplar;
  double demonstrated_weight = 1.0;  ///< pull to the demonstrated joints, 0: none
  int max_branches = 6;              ///< ways of standing that are tried before the plan is refused
  /// What the hand carries on the way, as FindCarries says; the checker knows their bodies.
  std::vector<Carry> carries = {};
};

/// Figures of a plan, for people and for the demo's last line.
struct PlanReport {
  double max_position_error_m = 0;  ///< path against the skill's motion, outside contact
  double max_contact_error_m = 0;   ///< in contact
  double max_rotation_error_rad = 0;
  collision::Clearance smallest_clearance;
  double smallest_clearance_time_s = 0;
  double time_stretch = 1;        ///< how much slower than demonstrated, 1: as demonstrated
  double style_error_rad = 0;     ///< root mean square difference to the demonstrated joints
  double max_joint_step_rad = 0;  ///< largest step of a joint between two frames of the skill
  int branches_tried = 1;
  double approach_s = 0;  ///< time from the start state to the motion's first frame
  std::vector<std::string> warnings;
};

/// Intervals of the trajectory in which the tool is in contact.
struct ContactWindow {
  std::string object;
  double begin_s = 0;
  double end_s = 0;
  Eigen::Vector3d base_p_contact = Eigen::Vector3d::Zero();
};

/// When the touch links may touch an object: a contact with its margins, or the way out of the
/// touch in which the motion begins.
struct TouchWindow {
  std::string object;
  double begin_s = 0;
  double end_s = 0;
};

/// When each body of a Carry counts.
struct CarryWindow {
  std::string object, held, laid;
  std::vector<std::string> from, to;
  double begin_s = 0;    ///< the hand closes
  double lifted_s = 0;   ///< from here on it is away from where it stood
  double lowered_s = 0;  ///< from here on it is near to where it is laid
  double end_s = 0;      ///< the hand opens
  double left_s = 0;     ///< from here on the touch links are away from it
};

struct PlannedMotion {
  JointTrajectory trajectory;
  std::vector<ContactWindow> contacts;
  std::vector<TouchWindow> touches;
  std::vector<CarryWindow> carries = {};
  std::vector<double> frame_time_s = {};  ///< when each frame of the skill's motion is reached
  PlanReport report = {};
};

/// Who may touch what at a time of the plan, `later_s` after windows end still; bodies that do not
/// count at that time may be touched by all.
std::vector<collision::AllowedTouch> AllowedAt(const PlannedMotion& plan,
                                               const std::vector<std::string>& touch_links,
                                               double time_s, double later_s = 0);
/// The times at which that changes, in any order.
std::vector<double> AllowedEdges(const PlannedMotion& plan);

/// IK along the whole motion, collision checks at and between frames, timing within limits.
/// `start` (chain.dof() values): where the robot is. Refusals are kFailedPrecondition and say when,
/// which links, how deep, or which frame is out of reach and by how much.
Result<PlannedMotion> PlanMotion(const demonstration::SkillMotion& motion,
                                 const kinematics::RobotModel& model,
                                 const kinematics::Chain& chain,
                                 const collision::CollisionChecker& checker,
                                 const Eigen::Ref<const Eigen::VectorXd>& start,
                                 const PlanOptions& options = {}, std::stop_token stop = {});

}  // namespace exemplar::motion
