#include "exemplar/ros2/graph.hpp"

#include <algorithm>
#include <utility>

#include "cdr.hpp"

namespace exemplar::ros2 {
namespace {

void Put(CdrWriter& cdr, const Gid& gid, GidLayout layout) {
  for (const std::uint8_t byte : gid) cdr.Put(byte);
  for (auto i = gid.size(); i < static_cast<std::size_t>(layout); ++i) cdr.Put(std::uint8_t{0});
}

void Put(CdrWriter& cdr, const std::vector<Gid>& gids, GidLayout layout) {
  cdr.Put(static_cast<std::uint32_t>(gids.size()));
  for (const Gid& gid : gids) Put(cdr, gid, layout);
}

void Get(CdrReader& cdr, Gid& gid, GidLayout layout) {
  for (std::uint8_t& byte : gid) cdr.Get(byte);
  std::uint8_t rest = 0;
  for (auto i = gid.size(); i < static_cast<std::size_t>(layout); ++i) cdr.Get(rest);
}

/// At most as many as can be there: an entry takes at least `bytes`.
std::uint32_t GetCount(CdrReader& cdr, std::size_t bytes) {
  std::uint32_t count = 0;
  cdr.Get(count);
  return cdr.AtMost(count, bytes);
}

void Get(CdrReader& cdr, std::vector<Gid>& gids, GidLayout layout) {
  const std::uint32_t count = GetCount(cdr, static_cast<std::size_t>(layout));
  for (std::uint32_t i = 0; i < count; ++i) Get(cdr, gids.emplace_back(), layout);
}

Result<ParticipantEntities> DecodeAs(std::span<const std::uint8_t> bytes, GidLayout layout) {
  constexpr std::size_t kLeastOfANode = 16;  // four counts
  CdrReader cdr(bytes);
  ParticipantEntities entities;
  entities.layout = layout;
  Get(cdr, entities.gid, layout);
  const std::uint32_t nodes = GetCount(cdr, kLeastOfANode);
  for (std::uint32_t i = 0; i < nodes && cdr.status().ok(); ++i) {
    NodeEntities& node = entities.nodes.emplace_back();
    cdr.Get(node.node_namespace);
    cdr.Get(node.node_name);
    Get(cdr, node.readers, layout);
    Get(cdr, node.writers, layout);
  }
  if (!cdr.status().ok()) return cdr.status().error();
  if (cdr.left() > 0) {
    return InvalidArgument("a message of ros_discovery_info has " + std::to_string(cdr.left()) +
                           " bytes too many");
  }
  return entities;
}

}  // namespace

Gid ParticipantOf(const Gid& endpoint) {
  constexpr std::array<std::uint8_t, 4> kParticipant = {0, 0, 1, 0xc1};
  Gid gid = endpoint;
  std::copy(kParticipant.begin(), kParticipant.end(), gid.begin() + 12);
  return gid;
}

std::string GraphSchema(GidLayout layout) {
  return "module rmw_dds_common { module msg { module dds_ {\n"
         "struct Gid_ { octet data[" +
         std::to_string(static_cast<int>(layout)) +
         "]; };\n"
         "struct NodeEntitiesInfo_ {\n"
         "  string<256> node_namespace;\n"
         "  string<256> node_name;\n"
         "  sequence<Gid_> reader_gid_seq;\n"
         "  sequence<Gid_> writer_gid_seq;\n"
         "};\n"
         "struct ParticipantEntitiesInfo_ {\n"
         "  Gid_ gid;\n"
         "  sequence<NodeEntitiesInfo_> node_entities_info_seq;\n"
         "};\n"
         "}; }; };\n";
}

std::vector<std::uint8_t> Encode(const ParticipantEntities& entities) {
  CdrWriter cdr;
  Put(cdr, entities.gid, entities.layout);
  cdr.Put(static_cast<std::uint32_t>(entities.nodes.size()));
  for (const NodeEntities& node : entities.nodes) {
    cdr.Put(node.node_namespace);
    cdr.Put(node.node_name);
    Put(cdr, node.readers, entities.layout);
    Put(cdr, node.writers, entities.layout);
  }
  return std::move(cdr).Take();
}

Result<ParticipantEntities> DecodeParticipantEntities(
    std::span<const std::uint8_t> cdr_with_encapsulation) {
  Result<ParticipantEntities> entities = DecodeAs(cdr_with_encapsulation, GidLayout::kIron);
  if (entities.ok()) return entities;
  return DecodeAs(cdr_with_encapsulation, GidLayout::kHumble);
}

}  // namespace exemplar::ros2
