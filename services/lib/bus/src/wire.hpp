#pragma once
// Sample values to the generated message types and back: one Wire<Sample> each.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/ircp/samples.hpp"
#include "ircp/camera.h"
#include "ircp/clock.h"
#include "ircp/command.h"
#include "ircp/common.h"
#include "ircp/end_effector.h"
#include "ircp/joint_command.h"
#include "ircp/joint_state.h"
#include "ircp/objects.h"
#include "ircp/plan.h"
#include "ircp/safety.h"
#include "ircp/status.h"
#include "ircp/suit.h"
#include "ircp/tactile.h"

namespace exemplar::bus {

namespace v1 = ::exemplar::ircp::v1;

/// Stands for a position that was not measured.
inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

inline v1::Pose ToMessage(const geometry::Pose& pose) {
  v1::Pose message;
  const Eigen::Vector3d& t = pose.translation;
  const Eigen::Quaterniond& r = pose.rotation;
  message.position_m({t.x(), t.y(), t.z()});
  message.quaternion_xyzw({r.x(), r.y(), r.z(), r.w()});
  return message;
}

inline geometry::Pose FromMessage(const v1::Pose& message) {
  const auto& t = message.position_m();
  const auto& r = message.quaternion_xyzw();
  return {{t[0], t[1], t[2]}, {r[3], r[0], r[1], r[2]}};
}

inline std::vector<v1::Entry> ToMessage(const std::map<std::string, std::string>& entries) {
  std::vector<v1::Entry> messages;
  messages.reserve(entries.size());
  for (const auto& [name, value] : entries) {
    v1::Entry& entry = messages.emplace_back();
    entry.name(name);
    entry.value(value);
  }
  return messages;
}

inline std::map<std::string, std::string> FromMessage(std::vector<v1::Entry>&& messages) {
  std::map<std::string, std::string> entries;
  for (v1::Entry& entry : messages) entries[std::move(entry.name())] = std::move(entry.value());
  return entries;
}

/// kIdl names the .idl file, kLayout is for CheckCdrLayout, SecondKey the key beside source.
template <class Sample>
struct Wire;

template <>
struct Wire<ircp::SuitSample> {
  using Message = v1::Suit;
  static constexpr const char* kType = "Suit";
  static constexpr const char* kIdl = "suit";
  static constexpr const char* kLayout = "s88[s][8]";

  static void Fill(const ircp::SuitSample& sample, Message& message) {
    message.names(sample.names);
    message.positions(sample.positions);
  }
  static void Fill(Message& message, ircp::SuitSample& sample) {
    sample.names = std::move(message.names());
    sample.positions = std::move(message.positions());
  }
};

template <>
struct Wire<ircp::EndEffectorSample> {
  using Message = v1::EndEffector;
  static constexpr const char* kType = "EndEffector";
  static constexpr const char* kIdl = "end_effector";
  static constexpr const char* kLayout =
      "ss88"
      "8888888bb8b888888b4";
  static const std::string& SecondKey(const ircp::EndEffectorSample& s) { return s.hand; }

  static void Fill(const ircp::EndEffectorSample& sample, Message& message) {
    message.hand(sample.hand);
    message.base_T_tool(ToMessage(sample.base_T_tool));
    if (!sample.has_pose) message.base_T_tool().position_m().fill(kNotMeasured);
    message.has_orientation(sample.has_pose && sample.has_orientation);
    message.has_hand_open(sample.has_hand_open);
    message.hand_open(sample.hand_open);
    message.has_wrench(sample.has_wrench);
    message.wrench(sample.wrench);
    message.has_label(sample.has_label);
    message.label(sample.label);
  }
  static void Fill(Message& message, ircp::EndEffectorSample& sample) {
    sample.hand = std::move(message.hand());
    const auto& position = message.base_T_tool().position_m();
    sample.has_pose = !std::all_of(position.begin(), position.end(),
                                   [](double value) { return std::isnan(value); });
    if (sample.has_pose) sample.base_T_tool = FromMessage(message.base_T_tool());
    sample.has_orientation = message.has_orientation();
    sample.has_hand_open = message.has_hand_open();
    sample.hand_open = message.hand_open();
    sample.has_wrench = message.has_wrench();
    sample.wrench = message.wrench();
    sample.has_label = message.has_label();
    sample.label = message.label();
  }
};

template <>
struct Wire<ircp::TactileSample> {
  using Message = v1::Tactile;
  static constexpr const char* kType = "Tactile";
  static constexpr const char* kIdl = "tactile";
  static constexpr const char* kLayout = "s88[s][8]";

  static void Fill(const ircp::TactileSample& sample, Message& message) {
    message.sensors(sample.sensors);
    message.forces_n(sample.forces_n);
  }
  static void Fill(Message& message, ircp::TactileSample& sample) {
    sample.sensors = std::move(message.sensors());
    sample.forces_n = std::move(message.forces_n());
  }
};

template <>
struct Wire<ircp::CameraSample> {
  using Message = v1::Camera;
  static constexpr const char* kType = "Camera";
  static constexpr const char* kIdl = "camera";
  static constexpr const char* kLayout = "s88ssoo";

  static void Fill(const ircp::CameraSample& sample, Message& message) {
    message.calibration_id(sample.calibration_id);
    message.encoding(sample.encoding);
    message.left(sample.left);
    message.right(sample.right);
  }
  static void Fill(Message& message, ircp::CameraSample& sample) {
    sample.calibration_id = std::move(message.calibration_id());
    sample.encoding = std::move(message.encoding());
    sample.left = std::move(message.left());
    sample.right = std::move(message.right());
  }
};

template <>
struct Wire<ircp::ObjectSample> {
  using Message = v1::ObjectPose;
  static constexpr const char* kType = "ObjectPose";
  static constexpr const char* kIdl = "objects";
  static constexpr const char* kLayout =
      "ss88s"
      "8888888b8888";
  static const std::string& SecondKey(const ircp::ObjectSample& s) { return s.name; }

  static void Fill(const ircp::ObjectSample& sample, Message& message) {
    message.name(sample.name);
    message.frame(sample.frame);
    message.base_T_object(ToMessage(sample.base_T_object));
    message.has_orientation(sample.has_orientation);
    message.position_variance_m2(sample.position_variance_m2);
    message.rotation_variance_rad2(sample.rotation_variance_rad2);
  }
  static void Fill(Message& message, ircp::ObjectSample& sample) {
    sample.name = std::move(message.name());
    sample.frame = std::move(message.frame());
    sample.base_T_object = FromMessage(message.base_T_object());
    sample.has_orientation = message.has_orientation();
    sample.position_variance_m2 = message.position_variance_m2();
    sample.rotation_variance_rad2 = message.rotation_variance_rad2();
  }
};

template <>
struct Wire<ircp::JointStateSample> {
  using Message = v1::JointState;
  static constexpr const char* kType = "JointState";
  static constexpr const char* kIdl = "joint_state";
  static constexpr const char* kLayout = "s88[s][8][8][8]8[s][8]8";

  static void Fill(const ircp::JointStateSample& sample, Message& message) {
    message.names(sample.names);
    message.positions(sample.positions);
    message.velocities(sample.velocities);
    message.efforts(sample.efforts);
    message.hand_open(sample.hand_open);
    message.touch_sensors(sample.touch_sensors);
    message.touch_n(sample.touch_n);
    message.command_seq(sample.command_seq);
  }
  static void Fill(Message& message, ircp::JointStateSample& sample) {
    sample.names = std::move(message.names());
    sample.positions = std::move(message.positions());
    sample.velocities = std::move(message.velocities());
    sample.efforts = std::move(message.efforts());
    sample.hand_open = message.hand_open();
    sample.touch_sensors = std::move(message.touch_sensors());
    sample.touch_n = std::move(message.touch_n());
    sample.command_seq = message.command_seq();
  }
};

template <>
struct Wire<ircp::JointCommandSample> {
  using Message = v1::JointCommand;
  static constexpr const char* kType = "JointCommand";
  static constexpr const char* kIdl = "joint_command";
  static constexpr const char* kLayout = "s88[s][8][8]b88";

  static void Fill(const ircp::JointCommandSample& sample, Message& message) {
    message.names(sample.names);
    message.positions(sample.positions);
    message.velocities(sample.velocities);
    message.has_hand_open(sample.has_hand_open);
    message.hand_open(sample.hand_open);
    message.validity_ns(sample.validity.count());
  }
  static void Fill(Message& message, ircp::JointCommandSample& sample) {
    sample.names = std::move(message.names());
    sample.positions = std::move(message.positions());
    sample.velocities = std::move(message.velocities());
    sample.has_hand_open = message.has_hand_open();
    sample.hand_open = message.hand_open();
    sample.validity = Duration(message.validity_ns());
  }
};

template <>
struct Wire<ircp::PlanSample> {
  using Message = v1::Plan;
  static constexpr const char* kType = "Plan";
  static constexpr const char* kIdl = "plan";
  static constexpr const char* kLayout = "s88s[s][8][8][8]";

  static void Fill(const ircp::PlanSample& sample, Message& message) {
    message.skill(sample.skill);
    message.names(sample.names);
    message.times_s(sample.times_s);
    message.positions(sample.positions);
    message.tool_m(sample.tool_m);
  }
  static void Fill(Message& message, ircp::PlanSample& sample) {
    sample.skill = std::move(message.skill());
    sample.names = std::move(message.names());
    sample.times_s = std::move(message.times_s());
    sample.positions = std::move(message.positions());
    sample.tool_m = std::move(message.tool_m());
  }
};

template <>
struct Wire<ircp::CommandSample> {
  using Message = v1::Command;
  static constexpr const char* kType = "Command";
  static constexpr const char* kIdl = "command";
  static constexpr const char* kLayout = "s88sss[ss]8";

  static void Fill(const ircp::CommandSample& sample, Message& message) {
    message.program(sample.program);
    message.request_id(sample.request_id);
    message.action(sample.action);
    message.arguments(ToMessage(sample.arguments));
    message.validity_ns(sample.validity.count());
  }
  static void Fill(Message& message, ircp::CommandSample& sample) {
    sample.program = std::move(message.program());
    sample.request_id = std::move(message.request_id());
    sample.action = std::move(message.action());
    sample.arguments = FromMessage(std::move(message.arguments()));
    sample.validity = Duration(message.validity_ns());
  }
};

template <>
struct Wire<ircp::StatusSample> {
  using Message = v1::Status;
  static constexpr const char* kType = "Status";
  static constexpr const char* kIdl = "status";
  static constexpr const char* kLayout = "s88ssssb[ss][ss8]";

  static void Fill(const ircp::StatusSample& sample, Message& message) {
    message.program(sample.program);
    message.state(sample.state);
    message.detail(sample.detail);
    message.request_id(sample.request_id);
    message.ok(sample.ok);
    message.values(ToMessage(sample.values));
    for (const ircp::TopicCount& count : sample.sent) {
      v1::SentCount& sent = message.sent().emplace_back();
      sent.topic(count.topic);
      sent.source(count.source);
      sent.sent(count.sent);
    }
  }
  static void Fill(Message& message, ircp::StatusSample& sample) {
    sample.program = std::move(message.program());
    sample.state = std::move(message.state());
    sample.detail = std::move(message.detail());
    sample.request_id = std::move(message.request_id());
    sample.ok = message.ok();
    sample.values = FromMessage(std::move(message.values()));
    sample.sent.reserve(message.sent().size());
    for (v1::SentCount& sent : message.sent()) {
      sample.sent.push_back({std::move(sent.topic()), std::move(sent.source()), sent.sent()});
    }
  }
};

template <>
struct Wire<ircp::SafetySample> {
  using Message = v1::Safety;
  static constexpr const char* kType = "Safety";
  static constexpr const char* kIdl = "safety";
  static constexpr const char* kLayout = "s88bbb";

  static void Fill(const ircp::SafetySample& sample, Message& message) {
    message.dead_man_held(sample.dead_man_held);
    message.emergency_stop(sample.emergency_stop);
    message.reset(sample.reset);
  }
  static void Fill(Message& message, ircp::SafetySample& sample) {
    sample.dead_man_held = message.dead_man_held();
    sample.emergency_stop = message.emergency_stop();
    sample.reset = message.reset();
  }
};

template <>
struct Wire<ircp::ClockSample> {
  using Message = v1::Clock;
  static constexpr const char* kType = "Clock";
  static constexpr const char* kIdl = "clock";
  static constexpr const char* kLayout = "s88ss888";

  static void Fill(const ircp::ClockSample& sample, Message& message) {
    message.mode(sample.mode);
    message.peer(sample.peer);
    message.first_ns(sample.first.nanoseconds());
    message.second_ns(sample.second.nanoseconds());
    message.third_ns(sample.third.nanoseconds());
  }
  static void Fill(Message& message, ircp::ClockSample& sample) {
    sample.mode = std::move(message.mode());
    sample.peer = std::move(message.peer());
    sample.first = Stamp::FromNanoseconds(message.first_ns());
    sample.second = Stamp::FromNanoseconds(message.second_ns());
    sample.third = Stamp::FromNanoseconds(message.third_ns());
  }
};

}  // namespace exemplar::bus
