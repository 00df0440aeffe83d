#pragma once
// Whether what a robot says of its joints can be believed, by how one joint state follows another.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "executor/robot_view.hpp"
#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::executor {

struct StreamLimits {
  /// A joint may move by this many times its speed limit, and this much besides, between two
  /// states; more is a jump. States that come in one go are judged as if `burst` apart.
  double jump_factor = 1.5;
  double jump_margin_rad = 0.03;
  Duration burst = std::chrono::milliseconds(20);
  /// Not one joint changed in so long, though the commands moved by that: frozen.
  Duration frozen_patience = std::chrono::milliseconds(250);
  double frozen_motion_rad = 0.02;
  /// States may come so much later than the quickest of the motion, by the robot's own stamps.
  Duration delay_patience = std::chrono::milliseconds(250);
  /// Commands that the robot acts on may be so old, where it says which one it acts on.
  Duration command_patience = std::chrono::milliseconds(250);
};

/// The states of one motion. Thread-compatible.
class StateStream {
 public:
  StateStream(std::vector<std::string> joint_names, std::vector<kinematics::JointLimits> joints,
              const StreamLimits& limits)
      : joint_names_(std::move(joint_names)), joints_(std::move(joints)), limits_(limits) {}

  /// The next state, in the order of reception; `commanded`: the posture asked for last, the
  /// `sent`-th command of all, `period` after the one before. Says what is wrong, if anything.
  std::optional<std::string> Judge(const MeasuredState& state, const Eigen::VectorXd& commanded,
                                   std::uint64_t sent, Duration period);

 private:
  std::optional<std::string> Jump(const MeasuredState& state) const;
  std::optional<std::string> Frozen(const MeasuredState& state, const Eigen::VectorXd& commanded);
  std::optional<std::string> Delay(const MeasuredState& state);
  std::optional<std::string> CommandAge(const MeasuredState& state, std::uint64_t sent,
                                        Duration period);

  const std::vector<std::string> joint_names_;
  const std::vector<kinematics::JointLimits> joints_;
  const StreamLimits limits_;
  std::optional<MeasuredState> last_;
  Duration changed_{0};                  ///< when a joint last changed
  Eigen::VectorXd commanded_then_;       ///< what was asked for then
  std::optional<Duration> least_delay_;  ///< reception minus stamp: two clocks
  Duration last_current_{0};             ///< when the robot last acted on a command of ours
};

}  // namespace exemplar::executor
