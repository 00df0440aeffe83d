#include "exemplar/ros2/graph.hpp"

#include <gtest/gtest.h>

#include "exemplar/base/rng.hpp"

namespace exemplar::ros2 {
namespace {

Gid RandomGid(Rng& rng) {
  Gid gid{};
  for (std::uint8_t& byte : gid) byte = static_cast<std::uint8_t>(rng.Below(256));
  return gid;
}

ParticipantEntities RandomEntities(Rng& rng, GidLayout layout) {
  ParticipantEntities entities{RandomGid(rng), {}, layout};
  for (auto nodes = rng.Below(5); nodes > 0; --nodes) {
    NodeEntities& node = entities.nodes.emplace_back();
    node.node_name.assign(rng.Below(31), 'n');
    for (auto n = rng.Below(6); n > 0; --n) node.readers.push_back(RandomGid(rng));
    for (auto n = rng.Below(6); n > 0; --n) node.writers.push_back(RandomGid(rng));
  }
  return entities;
}

TEST(Graph, IsLaidOutAsTheSpecificationOfCdrSays) {
  ParticipantEntities entities;
  entities.gid = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 0, 1, 0xc1};
  entities.nodes = {{"/", "ab", {}, {{9}}}};
  const std::vector<std::uint8_t> expected = {
      0, 1, 0, 0,                                                // little-endian CDR
      1, 2, 3, 4, 5,   6,   7, 8, 9, 10, 11, 12, 0, 0, 1, 0xc1,  // gid
      1, 0, 0, 0,                                                // one node
      2, 0, 0, 0, '/', 0,   0, 0,                                // its namespace, padded
      3, 0, 0, 0, 'a', 'b', 0, 0,                                // its name, padded
      0, 0, 0, 0,                                                // no reader
      1, 0, 0, 0, 9,   0,   0, 0, 0, 0,  0,  0,  0, 0, 0, 0,    0, 0, 0, 0};
  EXPECT_EQ(Encode(entities), expected);
}

TEST(Graph, ComesBackAsItWasAndTellsItsLayout) {
  Rng rng(5);
  for (int i = 0; i < 2000; ++i) {
    const GidLayout layout = i % 2 == 0 ? GidLayout::kIron : GidLayout::kHumble;
    const ParticipantEntities entities = RandomEntities(rng, layout);
    const auto back = DecodeParticipantEntities(Encode(entities));
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(*back, entities);
  }
}

TEST(Graph, RefusesBytesThatAreWholeInNoLayout) {
  Rng rng(6);
  const std::vector<std::uint8_t> whole = Encode(RandomEntities(rng, GidLayout::kIron));
  for (std::size_t cut = 0; cut < whole.size(); ++cut) {
    EXPECT_FALSE(DecodeParticipantEntities(std::span(whole).first(cut)).ok()) << cut;
  }
  std::vector<std::uint8_t> huge = whole;
  huge[20] = huge[21] = huge[22] = huge[23] = 0xff;  // the count of nodes
  EXPECT_FALSE(DecodeParticipantEntities(huge).ok());
}

TEST(Graph, BearsAnyBytes) {
  Rng rng(7);
  for (int i = 0; i < 5000; ++i) {
    std::vector<std::uint8_t> bytes =
        Encode(RandomEntities(rng, i % 2 == 0 ? GidLayout::kIron : GidLayout::kHumble));
    for (int changes = 0; changes < 4; ++changes) {
      bytes[rng.Below(bytes.size())] = static_cast<std::uint8_t>(rng.Below(256));
    }
    const auto read = DecodeParticipantEntities(bytes);
    EXPECT_LE(read.ok() ? read->nodes.size() : 0, bytes.size());
  }
}

TEST(Graph, KnowsAnEndpointsParticipant) {
  const Gid writer = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 0, 3, 2};
  const Gid participant = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 0, 1, 0xc1};
  EXPECT_EQ(ParticipantOf(writer), participant);
}

}  // namespace
}  // namespace exemplar::ros2
