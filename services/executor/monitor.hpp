#pragma once
// Watches one execution by what the robot measures.

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "exemplar/api/services.hpp"
#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/motion/plan.hpp"

namespace exemplar::executor {

/// Limits past which an execution is stopped.
struct WatchLimits {
  double tracking_error_rad = 0.35;  ///< rad or m, of any joint: commanded against measured
  double touch_n = 120;
  double clearance_m = 0;  ///< of measured states, permitted touches aside
};

/// A measured state and what was asked of the robot when it arrived.
struct Measurement {
  Eigen::VectorXd joints;
  Eigen::VectorXd commanded;
  double touch_n = 0;
  double path_time_s = 0;  ///< on the plan's time
  double elapsed_s = 0;    ///< since the motion began, pauses and all
};

/// Thread-compatible. Keeps references to the robot and the plan.
class Monitor {
 public:
  Monitor(const kinematics::RobotDescription& robot, const motion::PlannedMotion& plan,
          collision::CollisionChecker checker, const WatchLimits& limits);

  /// Takes a measurement into the figures; says what is wrong, if anything.
  std::optional<std::string> Observe(const Measurement& measurement);

  /// Writes the figures of what was measured so far.
  void Report(api::ExecutionResult& result) const;
  double tracking_error_rad() const { return latest_tracking_rad_; }

 private:
  const kinematics::RobotDescription& robot_;
  const motion::PlannedMotion& plan_;
  collision::CollisionChecker checker_;
  WatchLimits limits_;
  Eigen::VectorXd full_joints_;
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
