#include "exemplar/ircp/check.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace exemplar::ircp {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <class Sample>
Sample From(const std::string& source) {
  Sample sample;
  sample.header.source = source;
  return sample;
}

TEST(CheckTest, NamesTheValueAndItsPlace) {
  auto suit = From<SuitSample>("suit");
  suit.names = {"shoulder", "elbow"};
  suit.positions = {0.1, kNan};
  const Status status = Check(suit);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().message, "positions[1] (\"elbow\"): nan is not a finite number");
  EXPECT_EQ(status.error().field, "positions[1] (\"elbow\")");
}

TEST(CheckTest, WantsOneValueAName) {
  auto state = From<JointStateSample>("robot");
  state.names = {"a", "b"};
  state.positions = {1, 2};
  EXPECT_TRUE(Check(state).ok());
  state.velocities = {1};
  ASSERT_FALSE(Check(state).ok());
  EXPECT_EQ(Check(state).error().field, "velocities");
  state.velocities = {1, 2};
  EXPECT_TRUE(Check(state).ok());
  state.touch_n = {3};
  EXPECT_EQ(Check(state).error().field, "touch_n");
}

TEST(CheckTest, WantsUnitQuaternionsWhereThereIsAnOrientation) {
  auto tool = From<EndEffectorSample>("arm");
  EXPECT_TRUE(Check(tool).ok());
  tool.base_T_tool.rotation = Eigen::Quaterniond(0, 0, 0, 0);
  EXPECT_FALSE(Check(tool).ok());
  tool.base_T_tool.rotation = Eigen::Quaterniond(kNan, 0, 0, 0);
  EXPECT_FALSE(Check(tool).ok());
  tool.has_orientation = false;
  EXPECT_TRUE(Check(tool).ok());
  tool.base_T_tool.translation.y() = kNan;
  EXPECT_FALSE(Check(tool).ok());
}

TEST(CheckTest, WantsKeysOfUsableLength) {
  EXPECT_FALSE(Check(From<SafetySample>("")).ok());
  EXPECT_TRUE(Check(From<SafetySample>(std::string(kMaxKeyBytes, 'x'))).ok());
  EXPECT_FALSE(Check(From<SafetySample>(std::string(kMaxKeyBytes + 1, 'x'))).ok());
  auto object = From<ObjectSample>("vision");
  EXPECT_EQ(Check(object).error().field, "name");
}

}  // namespace
}  // namespace exemplar::ircp
