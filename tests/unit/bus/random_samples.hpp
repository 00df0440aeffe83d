#pragma once
// Random valid samples of every type.

#include <string>
#include <tuple>
#include <vector>

#include "exemplar/base/rng.hpp"
#include "exemplar/ircp/samples.hpp"

namespace exemplar::bus {

inline std::string RandomText(Rng& rng, std::size_t longest = 12) {
  std::string text(1 + rng.Below(longest), ' ');
  for (char& c : text) c = static_cast<char>('!' + static_cast<char>(rng.Below(90)));
  return text;
}

inline std::vector<std::string> RandomTexts(Rng& rng, std::size_t count) {
  std::vector<std::string> texts(count);
  for (std::string& text : texts) text = RandomText(rng);
  return texts;
}

inline std::vector<double> RandomNumbers(Rng& rng, std::size_t count) {
  std::vector<double> numbers(count);
  for (double& number : numbers) number = rng.Normal(0, 100);
  return numbers;
}

inline std::vector<std::uint8_t> RandomBytes(Rng& rng, std::size_t count) {
  std::vector<std::uint8_t> bytes(count);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(rng.NextBits());
  return bytes;
}

inline geometry::Pose RandomPose(Rng& rng) {
  return {{rng.Normal(), rng.Normal(), rng.Normal()},
          Eigen::Quaterniond(rng.Normal(), rng.Normal(), rng.Normal(), rng.Normal()).normalized()};
}

inline bool Coin(Rng& rng) { return rng.Below(2) == 1; }

inline Stamp RandomStamp(Rng& rng) {
  return Stamp::FromNanoseconds(static_cast<std::int64_t>(rng.NextBits()));
}

inline std::map<std::string, std::string> RandomMap(Rng& rng) {
  std::map<std::string, std::string> map;
  for (std::size_t i = rng.Below(4); i > 0; --i) map[RandomText(rng)] = RandomText(rng, 40);
  return map;
}

inline void Fill(Rng& rng, ircp::Header& header) {
  header = {.source = RandomText(rng), .seq = rng.NextBits(), .stamp = RandomStamp(rng)};
}

inline void Fill(Rng& rng, ircp::SuitSample& s) {
  Fill(rng, s.header);
  const std::size_t n = rng.Below(50);
  s.names = RandomTexts(rng, n);
  s.positions = RandomNumbers(rng, n);
}

inline void Fill(Rng& rng, ircp::EndEffectorSample& s) {
  Fill(rng, s.header);
  if (Coin(rng)) s.hand = RandomText(rng);
  s.base_T_tool = RandomPose(rng);
  s.has_orientation = Coin(rng);
  s.has_pose = Coin(rng);
  if (!s.has_pose) {
    s.base_T_tool = {};
    s.has_orientation = false;
  }
  s.has_hand_open = Coin(rng);
  s.hand_open = rng.Uniform();
  s.has_wrench = Coin(rng);
  for (double& value : s.wrench) value = rng.Normal();
  s.has_label = Coin(rng);
  s.label = static_cast<std::int32_t>(rng.NextBits());
}

inline void Fill(Rng& rng, ircp::TactileSample& s) {
  Fill(rng, s.header);
  const std::size_t n = rng.Below(20);
  s.sensors = RandomTexts(rng, n);
  s.forces_n = RandomNumbers(rng, n);
}

inline void Fill(Rng& rng, ircp::CameraSample& s) {
  Fill(rng, s.header);
  s.calibration_id = RandomText(rng);
  s.encoding = "png";
  s.left = RandomBytes(rng, rng.Below(300));
  s.right = RandomBytes(rng, rng.Below(300));
}

inline void Fill(Rng& rng, ircp::ObjectSample& s) {
  Fill(rng, s.header);
  s.name = RandomText(rng);
  s.frame = RandomText(rng);
  s.base_T_object = RandomPose(rng);
  s.has_orientation = Coin(rng);
  for (double& value : s.position_variance_m2) value = rng.Uniform();
  s.rotation_variance_rad2 = rng.Uniform();
}

inline void Fill(Rng& rng, ircp::JointStateSample& s) {
  Fill(rng, s.header);
  const std::size_t n = rng.Below(12);
  s.names = RandomTexts(rng, n);
  s.positions = RandomNumbers(rng, n);
  if (Coin(rng)) s.velocities = RandomNumbers(rng, n);
  if (Coin(rng)) s.efforts = RandomNumbers(rng, n);
  s.hand_open = rng.Uniform();
  const std::size_t touches = rng.Below(4);
  s.touch_sensors = RandomTexts(rng, touches);
  s.touch_n = RandomNumbers(rng, touches);
  s.command_seq = rng.NextBits();
}

inline void Fill(Rng& rng, ircp::JointCommandSample& s) {
  Fill(rng, s.header);
  const std::size_t n = rng.Below(12);
  s.names = RandomTexts(rng, n);
  s.positions = RandomNumbers(rng, n);
  if (Coin(rng)) s.velocities = RandomNumbers(rng, n);
  s.hand_open = rng.Uniform();
  s.has_hand_open = Coin(rng);
  s.validity = Duration(static_cast<std::int64_t>(rng.Below(1'000'000'000)));
}

inline void Fill(Rng& rng, ircp::PlanSample& s) {
  Fill(rng, s.header);
  s.skill = RandomText(rng);
  const std::size_t n = rng.Below(5);
  s.names = RandomTexts(rng, n);
  const std::size_t times = rng.Below(5);
  s.times_s = RandomNumbers(rng, times);
  s.positions = RandomNumbers(rng, times * n);
  s.tool_m = RandomNumbers(rng, times * 3);
}

inline void Fill(Rng& rng, ircp::CommandSample& s) {
  Fill(rng, s.header);
  s.program = RandomText(rng);
  s.request_id = RandomText(rng);
  s.action = RandomText(rng);
  s.arguments = RandomMap(rng);
  s.validity = Duration(static_cast<std::int64_t>(rng.Below(1'000'000'000)));
}

inline void Fill(Rng& rng, ircp::StatusSample& s) {
  Fill(rng, s.header);
  s.program = RandomText(rng);
  s.state = RandomText(rng);
  s.detail = RandomText(rng, 60);
  if (Coin(rng)) s.request_id = RandomText(rng);
  s.ok = Coin(rng);
  s.values = RandomMap(rng);
  for (std::size_t i = rng.Below(3); i > 0; --i) {
    s.sent.push_back({RandomText(rng), RandomText(rng), rng.NextBits()});
  }
}

inline void Fill(Rng& rng, ircp::SafetySample& s) {
  Fill(rng, s.header);
  s.dead_man_held = Coin(rng);
  s.emergency_stop = Coin(rng);
  s.reset = Coin(rng);
}

inline void Fill(Rng& rng, ircp::ClockSample& s) {
  Fill(rng, s.header);
  s.mode = RandomText(rng);
  s.peer = RandomText(rng);
  s.first = RandomStamp(rng);
  s.second = RandomStamp(rng);
  s.third = RandomStamp(rng);
}

// The members of each sample, for comparison.
inline auto Members(const geometry::Pose& p) {
  return std::tuple(p.translation.x(), p.translation.y(), p.translation.z(), p.rotation.x(),
                    p.rotation.y(), p.rotation.z(), p.rotation.w());
}
inline auto Members(const ircp::Header& h) { return std::tie(h.source, h.seq, h.stamp); }
inline auto Members(const ircp::SuitSample& s) {
  return std::tuple(Members(s.header), s.names, s.positions);
}
inline auto Members(const ircp::EndEffectorSample& s) {
  return std::tuple(Members(s.header), s.hand, s.has_pose, Members(s.base_T_tool),
                    s.has_orientation, s.has_hand_open, s.hand_open, s.has_wrench, s.wrench,
                    s.has_label, s.label);
}
inline auto Members(const ircp::TactileSample& s) {
  return std::tuple(Members(s.header), s.sensors, s.forces_n);
}
inline auto Members(const ircp::CameraSample& s) {
  return std::tuple(Members(s.header), s.calibration_id, s.encoding, s.left, s.right);
}
inline auto Members(const ircp::ObjectSample& s) {
  return std::tuple(Members(s.header), s.name, s.frame, Members(s.base_T_object), s.has_orientation,
                    s.position_variance_m2, s.rotation_variance_rad2);
}
inline auto Members(const ircp::JointStateSample& s) {
  return std::tuple(Members(s.header), s.names, s.positions, s.velocities, s.efforts, s.hand_open,
                    s.touch_sensors, s.touch_n, s.command_seq);
}
inline auto Members(const ircp::JointCommandSample& s) {
  return std::tuple(Members(s.header), s.names, s.positions, s.velocities, s.hand_open,
                    s.has_hand_open, s.validity);
}
inline auto Members(const ircp::PlanSample& s) {
  return std::tuple(Members(s.header), s.skill, s.names, s.times_s, s.positions, s.tool_m);
}
inline auto Members(const ircp::CommandSample& s) {
  return std::tuple(Members(s.header), s.program, s.request_id, s.action, s.arguments, s.validity);
}
inline auto Members(const ircp::StatusSample& s) {
  std::vector<std::tuple<std::string, std::string, std::uint64_t>> sent;
  for (const ircp::TopicCount& count : s.sent) {
    sent.emplace_back(count.topic, count.source, count.sent);
  }
  return std::tuple(Members(s.header), s.program, s.state, s.detail, s.request_id, s.ok, s.values,
                    sent);
}
inline auto Members(const ircp::SafetySample& s) {
  return std::tuple(Members(s.header), s.dead_man_held, s.emergency_stop, s.reset);
}
inline auto Members(const ircp::ClockSample& s) {
  return std::tuple(Members(s.header), s.mode, s.peer, s.first, s.second, s.third);
}

}  // namespace exemplar::bus
