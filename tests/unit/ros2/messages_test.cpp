#include "exemplar/ros2/messages.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "exemplar/base/rng.hpp"

namespace exemplar::ros2 {
namespace {

JointState Example() {
  JointState state;
  state.header.stamp = Stamp::FromNanoseconds(5'000'000'007);
  state.header.frame_id = "b";
  state.name = {"elbow"};
  state.position = {1.5};
  return state;
}

// The bytes as rosidl's typesupport for Fast DDS writes them, by hand from the CDR specification.
TEST(Messages, AreLaidOutAsTheSpecificationOfCdrSays) {
  const std::vector<std::uint8_t> expected = {
      0, 1, 0, 0,                     // little-endian CDR
      5, 0, 0, 0, 7,   0,   0,    0,  // sec, nanosec
      2, 0, 0, 0, 'b', 0,   0,    0,  // frame_id, padded
      1, 0, 0, 0,                     // one name
      6, 0, 0, 0, 'e', 'l', 'b',  'o',  'w', 0,
      0, 0, 1, 0, 0,   0,   0,    0,    0,   0,  // one position, and room up to 40 = 5 x 8
      0, 0, 0, 0, 0,   0,   0xf8, 0x3f,          // 1.5
      0, 0, 0, 0, 0,   0,   0,    0};            // no velocity, no effort
  EXPECT_EQ(Encode(Example()), expected);
}

TEST(Messages, ComeBackAsTheyWere) {
  JointState state = Example();
  state.name = {"a", "", "long_name_of_a_joint"};
  state.position = {1, -2, 1e-300};
  state.velocity = {0.25, 0, 3};
  const Result<JointState> back = DecodeJointState(Encode(state));
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(back->header.stamp, state.header.stamp);
  EXPECT_EQ(back->header.frame_id, "b");
  EXPECT_EQ(back->name, state.name);
  EXPECT_EQ(back->position, state.position);
  EXPECT_EQ(back->velocity, state.velocity);
  EXPECT_TRUE(back->effort.empty());
}

TEST(Messages, AreReadInTheOtherByteOrder) {
  const std::vector<std::uint8_t> big = {0, 0,   0, 0, 0, 0, 0, 5, 0, 0, 0, 7, 0, 0,    0,
                                         2, 'b', 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0x3f, 0xf8,
                                         0, 0,   0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  // 24 bytes before the count of positions: its number begins at 28 - 4 = 24, already aligned.
  const Result<JointState> state = DecodeJointState(big);
  ASSERT_TRUE(state.ok()) << state.error().message;
  EXPECT_EQ(state->header.stamp, Stamp::FromNanoseconds(5'000'000'007));
  EXPECT_EQ(state->position, std::vector<double>{1.5});
}

TEST(Messages, TimesBeforeTheEpochRoundDownward) {
  JointState state = Example();
  state.header.stamp = Stamp::FromNanoseconds(-1);
  const Result<JointState> back = DecodeJointState(Encode(state));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->header.stamp, Stamp::FromNanoseconds(-1));
}

TEST(Messages, EveryCutIsRefusedAndNoDamageCrashes) {
  const std::vector<std::uint8_t> whole = Encode(Example());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(DecodeJointState({whole.data(), size}).ok()) << size;
  }
  Rng rng(3);
  for (int round = 0; round < 20000; ++round) {
    std::vector<std::uint8_t> damaged = whole;
    for (int i = 0; i < 3; ++i) {
      damaged[4 + rng.Below(damaged.size() - 4)] = static_cast<std::uint8_t>(rng.Below(256));
    }
    const Result<JointState> read = DecodeJointState(damaged);
    if (read.ok()) {
      EXPECT_LE(read->position.size(), whole.size());
    }
  }
}

TEST(Names, AreMappedAsRos2MapsThem) {
  EXPECT_EQ(DdsTopic("/joint_states"), "rt/joint_states");
  EXPECT_EQ(DdsTopic("joint_states"), "rt/joint_states");
  EXPECT_EQ(TypeNameOf<JointState>(), "sensor_msgs::msg::dds_::JointState_");
  EXPECT_EQ(NameToken("red block-2"), "red_block_2");
  EXPECT_EQ(NameToken("2nd"), "_2nd");
}

}  // namespace
}  // namespace exemplar::ros2
