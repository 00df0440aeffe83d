#pragma once
// What a real robot's driver does between ircp/joint_command and its joints (docs/driver.md). The
// joints here move exactly as they are told: a driver puts its robot's interface in their place.

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "exemplar/base/stamp.hpp"
#include "exemplar/ircp/samples.hpp"
#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::reference_driver {

/// Where a command says nothing of its validity.
inline constexpr Duration kPatience = std::chrono::milliseconds(250);

/// Thread-compatible. `now` is one steady clock's and never goes back.
class Driver {
 public:
  /// `start` (n = names.size() = limits.size()): where the joints are.
  Driver(std::vector<std::string> names, std::vector<kinematics::JointLimits> limits,
         const Eigen::VectorXd& start);

  /// Takes the newest command. False where it has no sense for these joints: it is counted, and
  /// what was commanded before goes on.
  bool Take(const ircp::JointCommandSample& command, Duration now);
  /// Moves the joints to where they are at `now`, within their limits. A command that is older than
  /// its validity moves nothing: the joints brake, and hold.
  void Step(Duration now);
  /// As measured; the bus adds source, seq and stamp.
  ircp::JointStateSample State() const;

  bool is_following() const { return is_following_; }
  std::uint64_t refused() const { return refused_; }
  /// How often commands stopped coming.
  std::uint64_t stale() const { return stale_; }

 private:
  void Brake(double dt_s);

  std::vector<std::string> names_;
  std::vector<kinematics::JointLimits> limits_;
  Eigen::VectorXd positions_, velocities_;
  Eigen::VectorXd target_, target_velocities_;
  bool is_following_ = false;
  Duration received_{0};
  Duration validity_{0};
  Duration last_step_{0};
  bool has_stepped_ = false;
  double hand_open_ = 1;
  std::uint64_t command_seq_ = 0;
  std::uint64_t refused_ = 0;
  std::uint64_t stale_ = 0;
};

}  // namespace exemplar::reference_driver
