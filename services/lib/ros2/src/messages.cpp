#include "exemplar/ros2/messages.hpp"

#include <algorithm>
#include <utility>

#include "cdr.hpp"

namespace exemplar::ros2 {
namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

/// builtin_interfaces/msg/Time and Duration: seconds rounded down, and the rest.
void PutTime(CdrWriter& cdr, std::int64_t nanoseconds) {
  std::int64_t seconds = nanoseconds / kNanosecondsPerSecond;
  std::int64_t rest = nanoseconds % kNanosecondsPerSecond;
  if (rest < 0) {
    --seconds;
    rest += kNanosecondsPerSecond;
  }
  cdr.Put(static_cast<std::int32_t>(seconds));
  cdr.Put(static_cast<std::uint32_t>(rest));
}

void Put(CdrWriter& cdr, const Header& header) {
  PutTime(cdr, header.stamp.nanoseconds());
  cdr.Put(header.frame_id);
}

void Put(CdrWriter& cdr, const geometry::Pose& pose) {
  for (const double value : pose.translation) cdr.Put(value);
  for (const double value : pose.rotation.coeffs()) cdr.Put(value);  // x y z w
}

void Put(CdrWriter& cdr, const JointState& message) {
  Put(cdr, message.header);
  cdr.Put(message.name);
  cdr.Put(message.position);
  cdr.Put(message.velocity);
  cdr.Put(message.effort);
}

void Put(CdrWriter& cdr, const TransformMessage& message) {
  cdr.Put(static_cast<std::uint32_t>(message.transforms.size()));
  for (const TransformStamped& transform : message.transforms) {
    Put(cdr, transform.header);
    cdr.Put(transform.child_frame_id);
    Put(cdr, transform.transform);
  }
}

void Put(CdrWriter& cdr, const PoseStamped& message) {
  Put(cdr, message.header);
  Put(cdr, message.pose);
}

void Put(CdrWriter& cdr, const JointTrajectory& message) {
  Put(cdr, message.header);
  cdr.Put(message.joint_names);
  cdr.Put(static_cast<std::uint32_t>(message.points.size()));
  for (const JointTrajectoryPoint& point : message.points) {
    cdr.Put(point.positions);
    cdr.Put(point.velocities);
    cdr.Put(point.accelerations);
    cdr.Put(point.effort);
    PutTime(cdr, point.time_from_start.count());
  }
}

void Put(CdrWriter& cdr, const String& message) { cdr.Put(message.data); }

void Put(CdrWriter& cdr, const Clock& message) { PutTime(cdr, message.clock.nanoseconds()); }

// ---------------------------------------------------------------- schemas

/// `package`::msg::dds_::`body`, as rosidl's mapping onto DDS nests it.
std::string Module(std::string_view package, std::string_view body) {
  return "module " + std::string(package) + " { module msg { module dds_ {\n" + std::string(body) +
         "\n}; }; };\n";
}

std::string HeaderIdl() {
  return Module("builtin_interfaces",
                "struct Time_ { long sec; unsigned long nanosec; };\n"
                "struct Duration_ { long sec; unsigned long nanosec; };") +
         Module("std_msgs",
                "struct Header_ { builtin_interfaces::msg::dds_::Time_ stamp; string frame_id; };");
}

constexpr std::string_view kPointAndQuaternion =
    "struct Point_ { double x; double y; double z; };\n"
    "struct Vector3_ { double x; double y; double z; };\n"
    "struct Quaternion_ { double x; double y; double z; double w; };\n";

template <class Message>
struct Traits;

template <>
struct Traits<JointState> {
  static constexpr std::string_view kName = "sensor_msgs::msg::dds_::JointState_";
  static std::string Schema() {
    return HeaderIdl() + Module("sensor_msgs",
                                "struct JointState_ {\n"
                                "  std_msgs::msg::dds_::Header_ header;\n"
                                "  sequence<string> name;\n"
                                "  sequence<double> position;\n"
                                "  sequence<double> velocity;\n"
                                "  sequence<double> effort;\n"
                                "};");
  }
};

template <>
struct Traits<TransformMessage> {
  static constexpr std::string_view kName = "tf2_msgs::msg::dds_::TFMessage_";
  static std::string Schema() {
    return HeaderIdl() +
           Module("geometry_msgs",
                  std::string(kPointAndQuaternion) +
                      "struct Transform_ { Vector3_ translation; Quaternion_ rotation; };\n"
                      "struct TransformStamped_ {\n"
                      "  std_msgs::msg::dds_::Header_ header;\n"
                      "  string child_frame_id;\n"
                      "  Transform_ transform;\n"
                      "};") +
           Module("tf2_msgs",
                  "struct TFMessage_ {\n"
                  "  sequence<geometry_msgs::msg::dds_::TransformStamped_> transforms;\n"
                  "};");
  }
};

template <>
struct Traits<PoseStamped> {
  static constexpr std::string_view kName = "geometry_msgs::msg::dds_::PoseStamped_";
  static std::string Schema() {
    return HeaderIdl() +
           Module("geometry_msgs",
                  std::string(kPointAndQuaternion) +
                      "struct Pose_ { Point_ position; Quaternion_ orientation; };\n"
                      "struct PoseStamped_ { std_msgs::msg::dds_::Header_ header; Pose_ pose; };");
  }
};

template <>
struct Traits<JointTrajectory> {
  static constexpr std::string_view kName = "trajectory_msgs::msg::dds_::JointTrajectory_";
  static std::string Schema() {
    return HeaderIdl() + Module("trajectory_msgs",
                                "struct JointTrajectoryPoint_ {\n"
                                "  sequence<double> positions;\n"
                                "  sequence<double> velocities;\n"
                                "  sequence<double> accelerations;\n"
                                "  sequence<double> effort;\n"
                                "  builtin_interfaces::msg::dds_::Duration_ time_from_start;\n"
                                "};\n"
                                "struct JointTrajectory_ {\n"
                                "  std_msgs::msg::dds_::Header_ header;\n"
                                "  sequence<string> joint_names;\n"
                                "  sequence<JointTrajectoryPoint_> points;\n"
                                "};");
  }
};

template <>
struct Traits<String> {
  static constexpr std::string_view kName = "std_msgs::msg::dds_::String_";
  static std::string Schema() { return Module("std_msgs", "struct String_ { string data; };"); }
};

template <>
struct Traits<Clock> {
  static constexpr std::string_view kName = "rosgraph_msgs::msg::dds_::Clock_";
  static std::string Schema() {
    return Module("builtin_interfaces", "struct Time_ { long sec; unsigned long nanosec; };") +
           Module("rosgraph_msgs",
                  "struct Clock_ { builtin_interfaces::msg::dds_::Time_ clock; };");
  }
};

}  // namespace

template <class Message>
std::vector<std::uint8_t> Encode(const Message& message) {
  CdrWriter cdr;
  Put(cdr, message);
  return std::move(cdr).Take();
}

template <class Message>
std::string_view TypeNameOf() {
  return Traits<Message>::kName;
}

template <class Message>
std::string SchemaOf() {
  return Traits<Message>::Schema();
}

#define EXEMPLAR_ROS2_MESSAGE(Message)                       \
  template std::vector<std::uint8_t> Encode(const Message&); \
  template std::string_view TypeNameOf<Message>();           \
  template std::string SchemaOf<Message>();
EXEMPLAR_ROS2_MESSAGE(JointState)
EXEMPLAR_ROS2_MESSAGE(TransformMessage)
EXEMPLAR_ROS2_MESSAGE(PoseStamped)
EXEMPLAR_ROS2_MESSAGE(JointTrajectory)
EXEMPLAR_ROS2_MESSAGE(String)
EXEMPLAR_ROS2_MESSAGE(Clock)
#undef EXEMPLAR_ROS2_MESSAGE

Result<JointState> DecodeJointState(std::span<const std::uint8_t> cdr_with_encapsulation) {
  CdrReader cdr(cdr_with_encapsulation);
  JointState message;
  std::int32_t seconds = 0;
  std::uint32_t nanoseconds = 0;
  cdr.Get(seconds);
  cdr.Get(nanoseconds);
  message.header.stamp =
      Stamp::FromNanoseconds(seconds * kNanosecondsPerSecond + std::int64_t{nanoseconds});
  cdr.Get(message.header.frame_id);
  cdr.Get(message.name);
  cdr.Get(message.position);
  cdr.Get(message.velocity);
  cdr.Get(message.effort);
  if (!cdr.status().ok()) return cdr.status().error();
  return message;
}

std::string DdsTopic(std::string_view topic) {
  return "rt" + std::string(topic.starts_with('/') ? "" : "/") + std::string(topic);
}

std::string NameToken(std::string_view text) {
  std::string token;
  for (const char c : text) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    const bool digit = c >= '0' && c <= '9';
    if (digit && token.empty()) token += '_';
    token += letter || digit ? c : '_';
  }
  return token;
}

}  // namespace exemplar::ros2
