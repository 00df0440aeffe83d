#pragma once
// What the executor last heard of the robot and of the objects around it.

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "exemplar/api/services.hpp"
#include "exemplar/ircp/samples.hpp"
#include "exemplar/kinematics/chain.hpp"

namespace exemplar::executor {

/// The robot as measured once.
struct MeasuredState {
  Eigen::VectorXd joints;         ///< n = chain.dof(), in the chain's order
  double touch_n = 0;             ///< the largest of the touch sensors
  Duration received{0};           ///< steady time
  Stamp stamp = {};               ///< when it was measured, by the robot's clock
  std::uint64_t command_seq = 0;  ///< the command that the robot acted on; 0: it does not say
  bool feels_touch = false;       ///< it has a touch sensor
};

/// Thread-safe.
class RobotView {
 public:
  explicit RobotView(std::vector<std::string> joint_names) : joint_names_(std::move(joint_names)) {}

  /// Takes what a joint state says of the chain; nullopt (and a reason in problem()) where a joint
  /// of the chain is missing or not finite.
  std::optional<MeasuredState> Take(const ircp::JointStateSample& sample, Duration steady);
  void Take(const ircp::ObjectSample& sample, Duration steady);

  std::optional<MeasuredState> latest() const;
  /// Why the last joint state could not be used; empty when it could.
  std::string problem() const;
  std::vector<api::SeenObject> objects(Duration steady) const;

 private:
  struct Seen {
    geometry::NamedPose pose;
    Duration received{0};
  };
  const std::vector<std::string> joint_names_;
  mutable std::mutex mutex_;
  std::optional<MeasuredState> latest_;
  std::string problem_;
  std::map<std::string, Seen> objects_;
};

}  // namespace exemplar::executor
