#include "gateway/ros2_node.hpp"

#include <gtest/gtest.h>

#include "exemplar/ircp/memory_bus.hpp"
#include "exemplar/ros2/messages.hpp"
#include "gateway/ros2_bridge.hpp"
#include "memory_station.hpp"

namespace exemplar::gateway {
namespace {

using ros2::GidLayout;

constexpr ros2::Gid kNeighbour = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 1, 0xc1};

std::vector<std::uint8_t> Neighbour(GidLayout layout) {
  return ros2::Encode({kNeighbour, {{"/", "talker", {}, {}}}, layout});
}

class Ros2NodeTest : public ::testing::Test {
 protected:
  /// What was told last.
  ros2::ParticipantEntities Told() const {
    return *ros2::DecodeParticipantEntities(station_.written.at(station_.written.size() - 1));
  }

  MemoryStation station_;
};

TEST_F(Ros2NodeTest, SaysNothingBeforeItHearsANeighbour) {
  Ros2Node node(station_, "bridge");
  node.AddWriter({5});
  ASSERT_TRUE(node.Tell().ok());
  node.Hear(std::vector<std::uint8_t>{0, 1, 0, 0, 9});
  ASSERT_TRUE(node.Tell().ok());
  EXPECT_TRUE(station_.opened.empty());
}

TEST_F(Ros2NodeTest, TalksAsItsNeighbourDoes) {
  for (const GidLayout layout : {GidLayout::kHumble, GidLayout::kIron}) {
    Ros2Node node(station_, "bridge");
    node.AddWriter({5});
    node.AddReader({6});
    node.Hear(Neighbour(layout));
    ASSERT_TRUE(node.Tell().ok());
    const ros2::ParticipantEntities told = Told();
    EXPECT_EQ(told.layout, layout);
    EXPECT_EQ(told.gid, ros2::ParticipantOf(MemoryStation::GuidOf(station_.opened.size())));
    ASSERT_EQ(told.nodes.size(), 1U);
    EXPECT_EQ(told.nodes[0], (ros2::NodeEntities{"/", "bridge", {{6}}, {{5}}}));
  }
  EXPECT_EQ(station_.opened[0].topic, "ros_discovery_info");
  EXPECT_FALSE(station_.opened[0].keyed);
  EXPECT_TRUE(station_.opened[0].transient_local);
}

TEST_F(Ros2NodeTest, TellsAgainOnlyWhatChanged) {
  Ros2Node node(station_, "bridge");
  node.Hear(Neighbour(GidLayout::kIron));
  ASSERT_TRUE(node.Tell().ok());
  ASSERT_TRUE(node.Tell().ok());
  EXPECT_EQ(station_.written.size(), 1U);
  node.AddWriter({5});
  node.AddWriter({5});
  node.Hear(station_.written[0]);
  ASSERT_TRUE(node.Tell().ok());
  EXPECT_EQ(station_.written.size(), 2U);
  EXPECT_EQ(Told().nodes[0].writers, (std::vector<ros2::Gid>{{5}}));
}

TEST_F(Ros2NodeTest, TheBridgeIsANodeWithAllItsTopics) {
  const ManualClock clock;
  ircp::MemoryBus bus(clock);
  NullLog log;
  const auto bridge = Ros2Bridge::Create(bus, station_, station_, nullptr, {}, log);
  ASSERT_TRUE(bridge.ok());
  ircp::RawTopic topic;
  topic.topic = ros2::kGraphTopic;
  topic.type = ros2::kGraphType;
  station_.Appear(topic);
  station_.Arrive(topic.topic, 1, Neighbour(GidLayout::kIron));
  (*bridge)->Flush();
  std::vector<ros2::Gid> writers;
  for (std::size_t i = 1; i < station_.opened.size(); ++i) {
    writers.push_back(MemoryStation::GuidOf(i));  // the last one is that of ros_discovery_info
  }
  EXPECT_EQ(writers.size(), 6U);
  ASSERT_EQ(Told().nodes.size(), 1U);
  EXPECT_EQ(Told().nodes[0], (ros2::NodeEntities{"/", "exemplar_gateway", {}, writers}));

  const auto seen = bus.MakeWriter<ircp::ObjectSample>("tracker");
  ASSERT_TRUE(seen.ok());
  ircp::ObjectSample object;
  object.name = "cup";
  ASSERT_TRUE((*seen)->Write(object).ok());
  (*bridge)->Flush();
  writers.push_back(MemoryStation::GuidOf(station_.opened.size()));
  EXPECT_EQ(Told().nodes[0].writers, writers);
}

}  // namespace
}  // namespace exemplar::gateway
