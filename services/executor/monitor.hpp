#pragma once
// Watches one execution by what the robot measures.

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "executor/robot_view.hpp"
#include "executor/state_stream.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/motion/plan.hpp"

namespace exemplar::executor {

/// One for all joints, and others for some; rad or m.
struct JointTolerance {
  double general = 0;
  std::map<std::string, double> of_joint = {};

  double Of(const std::string& joint) const;
};

/// `words`: "0.3", or "joint7=0.1". Errors name the word and the joint that there is not.
Result<JointTolerance> ParseTolerance(const std::vector<std::string>& words,
                                      const std::vector<std::string>& joint_names, double general);

/// Limits past which an execution is stopped.
struct WatchLimits {
  JointTolerance path = {0.35, {}};  ///< commanded against measured
  JointTolerance goal = {0.1, {}};   ///< the last point against measured, once it is reached
  double touch_n = 120;
  double clearance_m = 0;  ///< of measured states, permitted touches aside
  /// Bodies nearer than `slow_within_m` that would meet in less than `slow_horizon_s`, as they
  /// approach each other now, slow the motion down in proportion.
  double slow_within_m = 0.03;
  double slow_horizon_s = 0.25;
  /// After an object moved, so much of the motion ahead is looked at again, this often.
  double look_ahead_s = 0.8;
  double look_again_s = 0.1;
  Duration command_period = std::chrono::milliseconds(8);
  StreamLimits stream = {};
};

/// A measured state and what was asked of the robot when it arrived.
struct Measurement {
  Eigen::VectorXd commanded;
  double path_time_s = 0;  ///< on the plan's time
  double elapsed_s = 0;    ///< since the motion began, pauses and all
  MeasuredState state = {};
  std::uint64_t commands_sent = 0;
};

/// Thread-compatible. Keeps references to the robot and the plan.
class Monitor {
 public:
  Monitor(const kinematics::RobotDescription& robot, const motion::PlannedMotion& plan,
          collision::CollisionChecker checker, const WatchLimits& limits);

  /// Takes a measurement into the figures; says what is wrong, if anything.
  std::optional<std::string> Observe(const Measurement& measurement);
  /// Objects are elsewhere now: the motion ahead is watched as well from here on.
  Status SetScene(collision::Scene scene);

  /// Writes the figures of what was measured so far.
  void Report(api::ExecutionResult& result) const;
  double tracking_error_rad() const { return latest_tracking_rad_; }
  /// The share of the speed that the approach of bodies leaves, in tenths; 1: all of it.
  double speed_share() const { return speed_share_; }
  /// Whether the last measurement was within tolerance of the motion's last point; else which joint
  /// is not.
  const std::optional<std::string>& not_arrived() const { return not_arrived_; }

 private:
  void OpenHandAsAt(double path_time_s);
  collision::Clearance ClearanceOf(const Eigen::VectorXd& joints,
                                   const std::vector<collision::AllowedTouch>& allowed);
  void NoteTouch(const Measurement& measurement, const geometry::Pose& base_T_tool);
  void NoteArrival(const Eigen::VectorXd& joints);
  void NoteApproach(const collision::Clearance& clearance, Duration received);
  std::optional<std::string> JointOffPath(const Measurement& measurement) const;
  std::optional<std::string> LookAhead(const Measurement& measurement);

  const kinematics::RobotDescription& robot_;
  const motion::PlannedMotion& plan_;
  collision::CollisionChecker checker_;
  WatchLimits limits_;
  StateStream stream_;
  Eigen::VectorXd full_joints_;
  Eigen::VectorXd ahead_, ahead_velocity_;
  bool scene_changed_ = false;
  double looked_ahead_at_s_ = 0;
  double speed_share_ = 1;
  double closing_m_s_ = 0;
  std::optional<collision::Clearance> last_clearance_;
  Duration last_received_{0};
  std::optional<std::string> not_arrived_;
  double latest_tracking_rad_ = 0;
  double largest_tracking_rad_ = 0;
  double smallest_clearance_m_ = std::numeric_limits<double>::infinity();
  std::optional<double> contact_error_m_;
  std::optional<double> touch_onset_s_;
  double touch_max_n_ = 0;
  std::vector<geometry::Pose> base_T_tool_;
  std::vector<double> tool_time_s_;
};

}  // namespace exemplar::executor
