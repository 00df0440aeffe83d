#include "csv_builder.hpp"

namespace exemplar::demonstration {
namespace {

using ::testing::AllOf;
using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pointwise;
using ::testing::SizeIs;
using ::testing::StartsWith;

/// A one-joint file whose joint value is the row's number.
std::string JointCsv(const std::vector<double>& time_s) {
  std::string text = "time_s,a_rad\n";
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    text += std::to_string(time_s[i]) + "," + std::to_string(i) + "\n";
  }
  return text;
}

std::vector<double> Regular(int count) {
  std::vector<double> time_s;
  for (int i = 0; i < count; ++i) time_s.push_back(0.01 * i);
  return time_s;
}

TEST(ClockRepair, SpreadsAStallUpToTheNextTick) {
  const Trial trial = MustRead(JointCsv({0, 0.01, 0.01, 0.01, 0.01, 0.05, 0.06}));
  EXPECT_THAT(trial.joints.time_s,
              Pointwise(DoubleNear(1e-12), {0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06}));
  EXPECT_THAT(trial.notices,
              ElementsAre(AllOf(HasSubstr("3 row(s)"), HasSubstr("stalls"), HasSubstr("line 4"))));
}

TEST(ClockRepair, SpreadsAStallAtTheEndByTheUsualStep) {
  const Trial trial = MustRead(JointCsv({0, 0.01, 0.02, 0.02}));
  EXPECT_THAT(trial.joints.time_s, Pointwise(DoubleNear(1e-12), {0.0, 0.01, 0.02, 0.03}));
}

TEST(ClockRepair, DropsRowsThatRepeatTheRowBefore) {
  const Trial trial = MustRead("time_s,a_rad\n0,1\n0.01,2\n0.01,2\n0.02,3\n");
  EXPECT_THAT(trial.joints.time_s, ElementsAre(0, 0.01, 0.02));
  EXPECT_THAT(trial.notices, ElementsAre(AllOf(HasSubstr("repeat"), HasSubstr("line 4"))));
}

TEST(ClockRepair, DropsARowThatRunsBack) {
  std::vector<double> time_s = Regular(100);
  time_s[50] = 0.3;
  const Trial trial = MustRead(JointCsv(time_s));
  EXPECT_THAT(trial.joints.time_s, SizeIs(99));
  EXPECT_EQ(trial.joints.values(50, 0), 51);
  EXPECT_THAT(trial.notices, ElementsAre(AllOf(HasSubstr("runs back"), HasSubstr("line 52"))));
}

TEST(ClockRepair, DropsARowThatJumpsAheadAndKeepsTheFollowers) {
  std::vector<double> time_s = Regular(100);
  time_s[50] = 7;
  const Trial trial = MustRead(JointCsv(time_s));
  EXPECT_THAT(trial.joints.time_s, SizeIs(99));
  EXPECT_DOUBLE_EQ(trial.joints.time_s.back(), 0.99);
  EXPECT_EQ(trial.joints.values(50, 0), 51);
}

TEST(ClockRepair, RefusesTimeThatStartsAnewWithTheLine) {
  std::vector<double> time_s = Regular(60);
  const std::vector<double> second = Regular(40);
  time_s.insert(time_s.end(), second.begin(), second.end());
  EXPECT_THAT(ErrorOf(JointCsv(time_s)),
              AllOf(StartsWith("trial.csv:62: time_s: time runs back from 0.59 s to 0 s"),
                    HasSubstr("40 of 100")));
}

TEST(ClockRepair, RefusesTimeThatNeverMoves) {
  EXPECT_THAT(ErrorOf(JointCsv({1, 1, 1})),
              AllOf(StartsWith("trial.csv:2: time_s:"), HasSubstr("all rows have the time 1 s")));
}

TEST(ClockRepair, CountsFromTheFirstSampleAndKeepsAUnixTimeAsStart) {
  const Trial offset = MustRead(JointCsv({5, 5.5}));
  EXPECT_THAT(offset.joints.time_s, ElementsAre(0, 0.5));
  EXPECT_EQ(offset.start, Stamp());
  const Trial unix_time = MustRead(JointCsv({1.6e9, 1.6e9 + 0.5}));
  EXPECT_THAT(unix_time.joints.time_s, ElementsAre(0, 0.5));
  EXPECT_EQ(unix_time.start, Stamp::FromSeconds(1.6e9));
}

TEST(ClockRepair, RefusesATimeInMilliseconds) {
  EXPECT_THAT(ErrorOf(JointCsv({1.6e12, 1.6e12 + 10})), HasSubstr("must be in seconds"));
}

TEST(ReadCsv, RefusesAZeroQuaternionWithItsLine) {
  std::vector<std::string> rows = ToolRows(10);
  rows[4] = "0.04,1,2,3,0,0,0,0";
  EXPECT_THAT(ErrorOf(Csv(kToolHeader, rows)),
              AllOf(StartsWith("trial.csv:6: ee_qx:"), HasSubstr("zero")));
}

TEST(ReadCsv, MakesQuaternionSignsContinuous) {
  std::vector<std::string> rows = ToolRows(10);
  rows[4] = "0.04,1,2,3,0,0,0,-1";
  const Trial trial = MustRead(Csv(kToolHeader, rows));
  EXPECT_EQ(trial.end_effectors.at(0).base_T_frame[4].rotation.w(), 1);
  EXPECT_THAT(trial.notices,
              ElementsAre(AllOf(StartsWith("trial.csv:6:"), HasSubstr("sign flips at 2"))));
}

TEST(ReadCsv, NormalisesQuaternionsOffUnitLength) {
  std::vector<std::string> rows = ToolRows(10);
  rows[4] = "0.04,1,2,3,0,0,0.6,0.9";
  const Trial trial = MustRead(Csv(kToolHeader, rows));
  EXPECT_NEAR(trial.end_effectors.at(0).base_T_frame[4].rotation.norm(), 1, 1e-12);
  EXPECT_THAT(trial.notices, ElementsAre(HasSubstr("normalised")));
  rows[4] = "0.04,1,2,3,90,0,45,0";
  EXPECT_THAT(ErrorOf(Csv(kToolHeader, rows)), HasSubstr("must be 1"));
}

TEST(ReadCsv, LeavesOutSingleSamplesThatAreNotFinite) {
  std::vector<std::string> rows = ToolRows(40);
  rows[7] = "0.07,1,nan,3,0,0,0,1";
  const Trial trial = MustRead(Csv(kToolHeader, rows));
  EXPECT_THAT(trial.end_effectors.at(0).time_s, SizeIs(39));
  EXPECT_THAT(trial.notices,
              ElementsAre(AllOf(StartsWith("trial.csv:9: ee_y_m:"), HasSubstr("1 of 40"))));
}

TEST(ReadCsv, RefusesManySamplesThatAreNotFinite) {
  std::vector<std::string> rows = ToolRows(40);
  for (std::size_t i : {7u, 8u, 9u}) rows[i] = "0.0" + std::to_string(i) + ",1,2,inf,0,0,0,1";
  EXPECT_THAT(ErrorOf(Csv(kToolHeader, rows)),
              AllOf(StartsWith("trial.csv:9: ee_z_m:"), HasSubstr("3 of 40")));
}

TEST(ReadCsv, LeavesOutARowWithoutAFiniteTime) {
  const Trial trial = MustRead("time_s,a_rad\n0,1\nnan,2\n0.02,3\n");
  EXPECT_THAT(trial.joints.time_s, ElementsAre(0, 0.02));
  EXPECT_THAT(trial.notices, ElementsAre(HasSubstr("without a finite time")));
}

TEST(ReadCsv, SaysNothingOfAFileWithoutFaults) {
  EXPECT_THAT(MustRead(Csv(kToolHeader, ToolRows(50))).notices, IsEmpty());
}

}  // namespace
}  // namespace exemplar::demonstration
