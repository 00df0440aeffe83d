#pragma once
// The messages of ROS 2 that the system speaks, as values and as the bytes that travel: CDR with
// its 4-byte encapsulation header, laid out as rosidl lays out common_interfaces (Humble and
// later).
//
// Free functions of their arguments only: thread-safe.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"
#include "exemplar/geometry/pose.hpp"

namespace exemplar::ros2 {

/// std_msgs/msg/Header
struct Header {
  Stamp stamp;
  std::string frame_id;
};

/// sensor_msgs/msg/JointState
struct JointState {
  Header header;
  std::vector<std::string> name;
  std::vector<double> position;  ///< rad or m; one a name, or empty
  std::vector<double> velocity;  ///< likewise
  std::vector<double> effort;    ///< likewise, N m or N
};

/// geometry_msgs/msg/TransformStamped: parent_T_child.
struct TransformStamped {
  Header header;  ///< frame_id is the parent
  std::string child_frame_id;
  geometry::Pose transform;
};

/// tf2_msgs/msg/TFMessage
struct TransformMessage {
  std::vector<TransformStamped> transforms;
};

/// geometry_msgs/msg/PoseStamped
struct PoseStamped {
  Header header;
  geometry::Pose pose;
};

/// trajectory_msgs/msg/JointTrajectoryPoint
struct JointTrajectoryPoint {
  std::vector<double> positions;
  std::vector<double> velocities;
  std::vector<double> accelerations;
  std::vector<double> effort;
  Duration time_from_start{0};
};

/// trajectory_msgs/msg/JointTrajectory
struct JointTrajectory {
  Header header;
  std::vector<std::string> joint_names;
  std::vector<JointTrajectoryPoint> points;
};

/// std_msgs/msg/String
struct String {
  std::string data;
};

/// rosgraph_msgs/msg/Clock
struct Clock {
  Stamp clock;
};

/// Little-endian CDR. Defined for JointState, TransformMessage, PoseStamped, JointTrajectory,
/// String and Clock.
template <class Message>
std::vector<std::uint8_t> Encode(const Message& message);

/// Either byte order. Errors name the byte: bytes that end too early or claim more than there are.
/// What a value means (finite numbers, one a name) is not judged here.
Result<JointState> DecodeJointState(std::span<const std::uint8_t> cdr_with_encapsulation);

/// The type's name on DDS, as ROS 2 maps it: "sensor_msgs::msg::dds_::JointState_".
template <class Message>
std::string_view TypeNameOf();

/// The type's flattened IDL, for recorders.
template <class Message>
std::string SchemaOf();

/// The DDS name of a ROS 2 topic: "/joint_states" is "rt/joint_states".
std::string DdsTopic(std::string_view topic);

/// A part of a ROS 2 name made of `text`: what is no letter, digit or underscore becomes an
/// underscore, and one goes before a digit at the start.
std::string NameToken(std::string_view text);

}  // namespace exemplar::ros2
