#pragma once
// What travels on the topics under ircp/, as values. bus/ maps them to DDS and back; nobody else
// knows DDS.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "exemplar/base/stamp.hpp"
#include "exemplar/geometry/pose.hpp"

namespace exemplar::ircp {

/// On every sample.
struct Header {
  std::string source;  ///< who sends it: "suit", "gripper-left"; the key of the topic's instances
  std::uint64_t seq = 0;  ///< the writer's own count, from 1, without gaps
  Stamp stamp;            ///< when it was measured, on the source's clock
};

/// ircp/suit: joint angles of the demonstrator.
struct SuitSample {
  static constexpr const char* kTopic = "ircp/suit";
  Header header;
  std::vector<std::string> names;
  std::vector<double> positions;  ///< rad or m, one a name
};

/// ircp/end_effector: the tool of whoever demonstrates.
struct EndEffectorSample {
  static constexpr const char* kTopic = "ircp/end_effector";
  Header header;
  std::string hand;      ///< "" for the only hand
  bool has_pose = true;  ///< false: only the other parts were measured at this time
  geometry::Pose base_T_tool;
  bool has_orientation = true;
  bool has_hand_open = false;
  double hand_open = 0;  ///< 0 closed to 1 open
  bool has_wrench = false;
  std::array<double, 6> wrench{};  ///< fx fy fz (N) tx ty tz (N m)
  bool has_label = false;
  std::int32_t label = 0;  ///< a person's phase label
};

/// ircp/tactile: force per sensor.
struct TactileSample {
  static constexpr const char* kTopic = "ircp/tactile";
  Header header;
  std::vector<std::string> sensors;
  std::vector<double> forces_n;
};

/// ircp/camera: a stereo pair.
struct CameraSample {
  static constexpr const char* kTopic = "ircp/camera";
  Header header;
  std::string calibration_id;
  std::string encoding;  ///< "jpeg", "png"
  std::vector<std::uint8_t> left;
  std::vector<std::uint8_t> right;
};

/// ircp/objects: one object, where it is.
struct ObjectSample {
  static constexpr const char* kTopic = "ircp/objects";
  Header header;
  std::string name;
  std::string frame;  ///< the frame the pose is in: the robot's base link
  geometry::Pose base_T_object;
  bool has_orientation = true;
  std::array<double, 3> position_variance_m2{};
  double rotation_variance_rad2 = 0;
};

/// ircp/joint_state: the robot as measured.
struct JointStateSample {
  static constexpr const char* kTopic = "ircp/joint_state";
  Header header;
  std::vector<std::string> names;
  std::vector<double> positions;
  std::vector<double> velocities;  ///< may be empty
  std::vector<double> efforts;     ///< may be empty
  double hand_open = 0;
  std::vector<std::string> touch_sensors;
  std::vector<double> touch_n;
  std::uint64_t command_seq = 0;  ///< of the last joint command the robot acted on
};

/// ircp/joint_command: only the executor writes it.
struct JointCommandSample {
  static constexpr const char* kTopic = "ircp/joint_command";
  Header header;
  std::vector<std::string> names;
  std::vector<double> positions;
  std::vector<double> velocities;  ///< may be empty
  double hand_open = 0;
  bool has_hand_open = false;
  Duration validity{0};  ///< after this long without another one the robot holds
};

/// ircp/plan: a motion that the executor has checked, for whoever draws it.
struct PlanSample {
  static constexpr const char* kTopic = "ircp/plan";
  Header header;
  std::string skill;
  std::vector<std::string> names;
  std::vector<double> times_s;    ///< from the start of the motion
  std::vector<double> positions;  ///< rad or m; times x names, row by row
  std::vector<double> tool_m;     ///< base frame; times x 3, row by row
};

/// ircp/<program>/command: control, with an answer on ircp/<program>/status.
struct CommandSample {
  Header header;
  std::string program;     ///< who is meant; names the topic
  std::string request_id;  ///< unique; a repeated one is answered again, not done again
  std::string action;      ///< "start", "stop", "place", ...
  std::map<std::string, std::string> arguments;
  Duration validity{0};  ///< judged on the receiver's steady clock; 0: no limit
};

/// What a writer has sent so far on one topic; losses are counted against it.
struct TopicCount {
  std::string topic;
  std::string source;
  std::uint64_t sent = 0;  ///< = seq of the last sample
};

/// ircp/<program>/status.
struct StatusSample {
  Header header;
  std::string program;
  std::string state;       ///< the program's state by name
  std::string detail;      ///< a sentence for a person
  std::string request_id;  ///< of the command this answers, or empty
  bool ok = true;          ///< of the answer
  std::map<std::string, std::string> values;
  std::vector<TopicCount> sent;
};

/// ircp/safety
struct SafetySample {
  static constexpr const char* kTopic = "ircp/safety";
  Header header;
  bool dead_man_held = false;
  bool emergency_stop = false;
  bool reset = false;
};

/// ircp/clock: time exchange (mode "probe"/"echo"), or simulated time (mode "sim").
struct ClockSample {
  static constexpr const char* kTopic = "ircp/clock";
  Header header;
  std::string mode;
  std::string peer;
  Stamp first, second, third;
};

std::string CommandTopic(std::string_view program);  ///< "ircp/recorder/command"
std::string StatusTopic(std::string_view program);   ///< "ircp/recorder/status"

}  // namespace exemplar::ircp
