#include "executor/state_stream.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "executor/monitor.hpp"

namespace exemplar::executor {
namespace {

using std::chrono::milliseconds;

constexpr Duration kPeriod = milliseconds(8);

/// Two joints that move at half a radian a second, as commanded.
class StateStreamTest : public ::testing::Test {
 protected:
  static std::vector<kinematics::JointLimits> Limits() {
    kinematics::JointLimits limits;
    limits.velocity = 2;
    return {limits, limits};
  }

  /// Cycles until something is wrong; at most `most`.
  int CyclesUntilWrong(int most, const std::function<void(MeasuredState&)>& change) {
    for (int cycle = 1; cycle <= most; ++cycle) {
      Advance();
      change(state_);
      wrong_ = stream_.Judge(state_, commanded_, sent_, kPeriod);
      if (wrong_) return cycle;
    }
    return most + 1;
  }

  void Advance() {
    now_ += kPeriod;
    ++sent_;
    commanded_.array() += 0.5 * ToSeconds(kPeriod);
    state_.received = now_;
    state_.stamp = Stamp::FromNanoseconds(5'000'000'000 + now_.count());
    state_.joints = commanded_;
    state_.command_seq = sent_;
  }

  StateStream stream_{{"shoulder", "elbow"}, Limits(), {}};
  Duration now_{0};
  std::uint64_t sent_ = 0;
  Eigen::VectorXd commanded_ = Eigen::VectorXd::Zero(2);
  MeasuredState state_;
  std::optional<std::string> wrong_;
};

TEST_F(StateStreamTest, BelievesARobotThatMoves) {
  EXPECT_EQ(CyclesUntilWrong(1000, [](MeasuredState&) {}), 1001);
}

TEST_F(StateStreamTest, SeesAJumpAtOnce) {
  CyclesUntilWrong(10, [](MeasuredState&) {});
  EXPECT_EQ(CyclesUntilWrong(10, [](MeasuredState& s) { s.joints[1] += 0.12; }), 1);
  EXPECT_NE(wrong_->find("\"elbow\""), std::string::npos) << *wrong_;
}

TEST_F(StateStreamTest, TakesStatesThatComeInOneGoForNoJump) {
  CyclesUntilWrong(10, [](MeasuredState&) {});
  const Duration burst = now_ + 20 * kPeriod;
  EXPECT_EQ(CyclesUntilWrong(20, [&](MeasuredState& s) { s.received = burst; }), 21) << *wrong_;
}

TEST_F(StateStreamTest, SeesAFrozenStateWithinItsPatience) {
  CyclesUntilWrong(10, [](MeasuredState&) {});
  const Eigen::VectorXd frozen = state_.joints;
  EXPECT_EQ(CyclesUntilWrong(100, [&](MeasuredState& s) { s.joints = frozen; }), 32);
  EXPECT_NE(wrong_->find("frozen"), std::string::npos) << *wrong_;
}

TEST_F(StateStreamTest, TakesARobotThatIsToRestForNoFrozenOne) {
  CyclesUntilWrong(10, [](MeasuredState&) {});
  const Eigen::VectorXd rest = commanded_;
  EXPECT_EQ(CyclesUntilWrong(200,
                             [&](MeasuredState& s) {
                               commanded_ = rest;
                               s.joints = rest;
                             }),
            201);
}

TEST_F(StateStreamTest, SeesStatesThatComeLateByTheirStampsWhateverTheClocks) {
  CyclesUntilWrong(10, [](MeasuredState&) {});
  EXPECT_EQ(CyclesUntilWrong(10, [](MeasuredState& s) { s.stamp = s.stamp - milliseconds(240); }),
            11);
  EXPECT_EQ(CyclesUntilWrong(10, [](MeasuredState& s) { s.stamp = s.stamp - milliseconds(260); }),
            1);
}

TEST_F(StateStreamTest, SeesThatCommandsAreActedOnLate) {
  CyclesUntilWrong(100, [](MeasuredState&) {});
  EXPECT_EQ(CyclesUntilWrong(10, [](MeasuredState& s) { s.command_seq -= 31; }), 11);
  EXPECT_EQ(CyclesUntilWrong(10, [](MeasuredState& s) { s.command_seq -= 32; }), 1);
}

TEST_F(StateStreamTest, SeesThatSomebodyElsesCommandsAreActedOn) {
  EXPECT_EQ(CyclesUntilWrong(100, [](MeasuredState& s) { s.command_seq += 1000; }), 33);
}

TEST_F(StateStreamTest, AsksNothingOfARobotThatNamesNoCommand) {
  EXPECT_EQ(CyclesUntilWrong(100, [](MeasuredState& s) { s.command_seq = 0; }), 101);
}

TEST(JointTolerance, IsOneForAllAndOthersForSome) {
  const std::vector<std::string> joints = {"shoulder", "elbow"};
  const Result<JointTolerance> read = ParseTolerance({"0.2", "elbow=0.05"}, joints, 0.35);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->Of("shoulder"), 0.2);
  EXPECT_EQ(read->Of("elbow"), 0.05);
  EXPECT_EQ(ParseTolerance({}, joints, 0.35)->Of("elbow"), 0.35);
  for (const char* word : {"wide", "-1", "elbow=", "knee=0.1", "elbow=0"}) {
    const Result<JointTolerance> refused = ParseTolerance({word}, joints, 0.35);
    ASSERT_FALSE(refused.ok()) << word;
    EXPECT_NE(refused.error().message.find(word), std::string::npos) << refused.error().message;
  }
}

}  // namespace
}  // namespace exemplar::executor
