#pragma once
// The station for a ROS 2 graph: what its robot does, where its objects are and what is planned, as
// ROS 2 nodes publish it; and a ROS 2 robot's joint states as the station's robot.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/metric.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/raw_writer.hpp"
#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::gateway {

struct Ros2Options {
  /// Largest rate of /joint_states and /tf, by the samples' own stamps.
  double max_rate_hz = 100;
  /// ROS 2 topic of sensor_msgs/JointState that is the station's robot; empty: the robot speaks
  /// DDS itself. With one, /joint_states is left to ROS 2.
  std::string robot_from = {};
  /// Told on /clock each 10 ms of its own, for nodes with use_sim_time; null: none.
  const Clock* clock = nullptr;
};

/// Publishes, in the graph:
///   /joint_states, /joint_command          sensor_msgs/JointState
///   /tf, /tf_static                        tf2_msgs/TFMessage: links by joints, objects by name
///   /robot_description                     std_msgs/String, the URDF; latched
///   /objects/<name>/pose                   geometry_msgs/PoseStamped
///   /planned_trajectory                    trajectory_msgs/JointTrajectory; latched
/// A graph that is behind loses the oldest samples; the station never waits for it. Thread-safe.
class Ros2Bridge {
 public:
  /// `robot` may be null: then there are no transforms of links. `outlet` and `taps` are a
  /// participant without partition. All outlive the bridge. Errors: a topic or file that cannot be.
  static Result<std::unique_ptr<Ros2Bridge>> Create(ircp::Bus& station, ircp::RawOutlet& outlet,
                                                    ircp::RawBus& taps,
                                                    const kinematics::RobotDescription* robot,
                                                    Ros2Options options, Log& log);
  virtual ~Ros2Bridge() = default;

  /// Waits until what came so far has been sent on.
  virtual void Flush() = 0;
  virtual std::uint64_t published() const = 0;
  /// Joint states of ROS 2 that became the robot's, and those that were refused.
  virtual std::uint64_t taken() const = 0;
  virtual std::uint64_t refused() const = 0;
};

/// They ask `bridge`, which must outlive them.
std::vector<Metric> MetricsOf(const Ros2Bridge& bridge);

}  // namespace exemplar::gateway
