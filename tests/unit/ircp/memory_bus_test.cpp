#include "exemplar/ircp/memory_bus.hpp"

#include <gtest/gtest.h>

namespace exemplar::ircp {
namespace {

SuitSample Suit(double angle) {
  SuitSample sample;
  sample.names = {"elbow"};
  sample.positions = {angle};
  return sample;
}

TEST(MemoryBusTest, NumbersAndStampsWhatItSends) {
  ManualClock clock(Stamp::FromNanoseconds(1000));
  MemoryBus bus(clock);
  std::vector<SuitSample> got;
  auto reader = bus.MakeReader<SuitSample>(
      [&](const SuitSample& sample, const Reception&) { got.push_back(sample); });
  auto writer = bus.MakeWriter<SuitSample>("suit");
  ASSERT_TRUE(reader.ok() && writer.ok());
  SuitSample stamped = Suit(2);
  stamped.header.stamp = Stamp::FromNanoseconds(5);
  ASSERT_TRUE((*writer)->Write(Suit(1)).ok());
  ASSERT_TRUE((*writer)->Write(stamped).ok());

  ASSERT_EQ(got.size(), 2u);
  EXPECT_EQ(got[0].header.source, "suit");
  EXPECT_EQ(got[0].header.seq, 1u);
  EXPECT_EQ(got[0].header.stamp, Stamp::FromNanoseconds(1000));
  EXPECT_EQ(got[1].header.seq, 2u);
  EXPECT_EQ(got[1].header.stamp, Stamp::FromNanoseconds(5));
  EXPECT_EQ((*writer)->sent(), 2u);
  EXPECT_EQ((*writer)->matched_readers(), 1);
  EXPECT_EQ((*reader)->matched_writers(), 1);
}

TEST(MemoryBusTest, CountsLossesBySourceAcrossARestart) {
  const ManualClock clock;
  MemoryBus bus(clock);
  auto reader = bus.MakeReader<SuitSample>([](const SuitSample&, const Reception&) {});
  bus.LoseWhere([](const std::string&, const Header& header) {
    return header.source == "a" && (header.seq == 2 || header.seq == 3);
  });
  for (int start = 0; start < 2; ++start) {
    auto a = bus.MakeWriter<SuitSample>("a");
    auto b = bus.MakeWriter<SuitSample>("b");
    for (int i = 0; i < 5; ++i) {
      ASSERT_TRUE((*a)->Write(Suit(i)).ok());
      ASSERT_TRUE((*b)->Write(Suit(i)).ok());
    }
  }
  const std::vector<SourceCount> counts = (*reader)->counts();
  ASSERT_EQ(counts.size(), 2u);
  EXPECT_EQ(counts[0].source, "a");
  EXPECT_EQ(counts[0].received, 6u);
  EXPECT_EQ(counts[0].lost, 4u);
  EXPECT_EQ(counts[1].received, 10u);
  EXPECT_EQ(counts[1].lost, 0u);
}

TEST(MemoryBusTest, GivesLateReadersStatusesOnly) {
  const ManualClock clock;
  MemoryBus bus(clock);
  auto suit = bus.MakeWriter<SuitSample>("suit");
  auto status = bus.MakeWriterOn<StatusSample>(StatusTopic("recorder"), "recorder");
  ASSERT_TRUE((*suit)->Write(Suit(1)).ok());
  StatusSample ready;
  ready.program = "recorder";
  ready.state = "ready";
  ASSERT_TRUE((*status)->Write(ready).ok());
  int suits = 0;
  std::vector<std::string> states;
  auto suit_reader =
      bus.MakeReader<SuitSample>([&](const SuitSample&, const Reception&) { ++suits; });
  auto status_reader = bus.MakeReaderOn<StatusSample>(
      StatusTopic("recorder"),
      [&](const StatusSample& sample, const Reception&) { states.push_back(sample.state); });
  EXPECT_EQ(suits, 0);
  EXPECT_EQ(states, std::vector<std::string>{"ready"});
}

TEST(MemoryBusTest, RefusesMalformedSamplesAndSecondTypes) {
  const ManualClock clock;
  MemoryBus bus(clock);
  auto writer = bus.MakeWriter<SuitSample>("suit");
  SuitSample bad = Suit(1);
  bad.names.emplace_back("wrist");
  EXPECT_FALSE((*writer)->Write(bad).ok());
  EXPECT_EQ((*writer)->sent(), 0u);
  EXPECT_FALSE(bus.MakeWriter<SuitSample>("").ok());
  EXPECT_FALSE(bus.MakeWriterOn<SafetySample>(SuitSample::kTopic, "x").ok());
}

TEST(MemoryBusTest, CallsNobodyWhoHasGone) {
  const ManualClock clock;
  MemoryBus bus(clock);
  int got = 0;
  auto writer = bus.MakeWriter<SuitSample>("suit");
  auto reader = bus.MakeReader<SuitSample>([&](const SuitSample&, const Reception&) { ++got; });
  ASSERT_TRUE((*writer)->Write(Suit(1)).ok());
  (*reader).reset();
  ASSERT_TRUE((*writer)->Write(Suit(2)).ok());
  EXPECT_EQ(got, 1);
  EXPECT_EQ((*writer)->matched_readers(), 0);
}

}  // namespace
}  // namespace exemplar::ircp
