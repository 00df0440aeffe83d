#pragma once
// Watches a teleoperated robot by what it measures.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "executor/monitor.hpp"
#include "executor/robot_view.hpp"
#include "executor/state_stream.hpp"
#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::executor {

/// A measured state and the command that was out when it arrived.
struct TeleoperationMeasurement {
  MeasuredState state = {};
  Eigen::VectorXd commanded;
  std::uint64_t commands_sent = 0;
};

/// Thread-compatible. The robot outlives it.
class TeleoperationWatch {
 public:
  TeleoperationWatch(const kinematics::RobotDescription& robot, collision::CollisionChecker checker,
                     std::vector<collision::AllowedTouch> touches, const WatchLimits& limits);

  /// Takes a measurement into the figures; says what is wrong, if anything.
  std::optional<std::string> Observe(const TeleoperationMeasurement& measurement);
  Status SetScene(collision::Scene scene) { return checker_.SetScene(std::move(scene)); }
  /// What the robot at `joints` is nearest to: `"forearm" and "table" are 5.1 mm apart`.
  std::string Nearest(const Eigen::VectorXd& joints);

  double tracking_error_rad() const { return tracking_rad_; }
  double largest_tracking_rad() const { return largest_tracking_rad_; }
  double touch_n() const { return touch_n_; }
  double touch_max_n() const { return touch_max_n_; }
  std::optional<double> clearance_m() const { return clearance_m_; }
  std::optional<double> smallest_clearance_m() const { return smallest_clearance_m_; }

 private:
  collision::Clearance ClearanceAt(const Eigen::VectorXd& joints);

  const kinematics::RobotDescription& robot_;
  collision::CollisionChecker checker_;
  const std::vector<collision::AllowedTouch> touches_;
  const WatchLimits limits_;
  StateStream stream_;
  Eigen::VectorXd full_;
  double tracking_rad_ = 0;
  double largest_tracking_rad_ = 0;
  double touch_n_ = 0;
  double touch_max_n_ = 0;
  std::optional<double> clearance_m_;
  std::optional<double> smallest_clearance_m_;
  std::optional<double> first_clearance_m_;
};

}  // namespace exemplar::executor
