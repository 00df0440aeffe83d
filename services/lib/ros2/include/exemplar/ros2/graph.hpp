#pragma once
// What a ROS 2 node tells of itself on the topic ros_discovery_info, by which `ros2 node list` and
// `ros2 node info` know it (rmw_dds_common).
//
// Free functions of their arguments only: thread-safe.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::ros2 {

/// A participant's or an endpoint's identity on DDS.
using Gid = std::array<std::uint8_t, 16>;

/// Of the participant that an endpoint belongs to (DDS Interoperability 9.3.1.3).
Gid ParticipantOf(const Gid& endpoint);

/// rmw_dds_common/msg/NodeEntitiesInfo
struct NodeEntities {
  std::string node_namespace = "/";
  std::string node_name;
  std::vector<Gid> readers;
  std::vector<Gid> writers;

  friend bool operator==(const NodeEntities&, const NodeEntities&) = default;
};

/// How many bytes a gid has on the wire; the type's name is the same.
enum class GidLayout {
  kHumble = 24,  ///< and before: eight zeros at the end
  kIron = 16,    ///< and since
};

/// rmw_dds_common/msg/ParticipantEntitiesInfo
struct ParticipantEntities {
  Gid gid{};
  std::vector<NodeEntities> nodes;
  GidLayout layout = GidLayout::kIron;

  friend bool operator==(const ParticipantEntities&, const ParticipantEntities&) = default;
};

inline constexpr std::string_view kGraphTopic = "ros_discovery_info";
inline constexpr std::string_view kGraphType =
    "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";

/// The type's flattened IDL, for recorders.
std::string GraphSchema(GidLayout layout);

/// Little-endian CDR with its encapsulation header.
std::vector<std::uint8_t> Encode(const ParticipantEntities& entities);

/// Either byte order. The layout is the one in which the bytes are whole: a message of the other
/// one is too long or too short. Errors: bytes that are whole in neither.
Result<ParticipantEntities> DecodeParticipantEntities(
    std::span<const std::uint8_t> cdr_with_encapsulation);

}  // namespace exemplar::ros2
