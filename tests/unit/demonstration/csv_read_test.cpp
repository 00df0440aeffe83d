#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "csv_builder.hpp"

namespace exemplar::demonstration {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

TEST(ReadCsv, ReadsEveryGroupOfTheFormat) {
  const Trial trial = MustRead(Csv(
      "time_s,elbow_rad,rail_m,ee_x_m,ee_y_m,ee_z_m,ee_qx,ee_qy,ee_qz,ee_qw,ee_left_x_m,"
      "ee_left_y_m,ee_left_z_m,object_red_box_x_m,object_red_box_y_m,object_red_box_z_m,"
      "object_lid_x_m,object_lid_y_m,object_lid_z_m,object_lid_qx,object_lid_qy,object_lid_qz,"
      "object_lid_qw,hand_open,hand_left_open,tactile_tip_n,wrench_fx_n,wrench_fy_n,wrench_fz_n,"
      "wrench_tx_nm,wrench_ty_nm,wrench_tz_nm,label",
      {"0,0.5,0.01,1,2,3,0,0,0,1,4,5,6,7,8,9,10,11,12,1,0,0,0,0.25,1,3.5,1,2,3,4,5,6,1",
       "0.01,0.6,0.02,1,2,3,0,0,0,1,4,5,6,7,8,9,10,11,12,1,0,0,0,0.5,0,4.5,1,2,3,4,5,6,2"}));
  EXPECT_THAT(trial.notices, IsEmpty());
  EXPECT_THAT(trial.joints.names, ElementsAre("elbow", "rail"));
  EXPECT_THAT(trial.prismatic_joints, ElementsAre("rail"));
  EXPECT_EQ(trial.joints.values(1, 0), 0.6);
  ASSERT_THAT(trial.end_effectors, SizeIs(2));
  EXPECT_EQ(trial.end_effectors[0].name, "");
  EXPECT_TRUE(trial.end_effectors[0].has_orientation);
  EXPECT_EQ(trial.end_effectors[1].name, "left");
  EXPECT_FALSE(trial.end_effectors[1].has_orientation);
  ASSERT_NE(trial.FindObject("red_box"), nullptr);
  EXPECT_FALSE(trial.FindObject("red_box")->has_orientation);
  ASSERT_NE(trial.FindObject("lid"), nullptr);
  EXPECT_EQ(trial.FindObject("lid")->base_T_frame[0].rotation.x(), 1);
  EXPECT_THAT(trial.hands.names, ElementsAre("", "left"));
  EXPECT_THAT(trial.tactile.names, ElementsAre("tip"));
  EXPECT_THAT(trial.wrench.names, ElementsAre("fx", "fy", "fz", "tx", "ty", "tz"));
  EXPECT_EQ(trial.wrench.values(0, 5), 6);
  EXPECT_EQ(trial.label.values(1, 0), 2);
  EXPECT_DOUBLE_EQ(trial.duration_s(), 0.01);
}

TEST(ReadCsv, ReadsJointsThatTheRobotMeasured) {
  const Trial trial = MustRead(Csv("time_s,elbow_rad,rail_m,elbow_rad_measured,rail_m_measured",
                                   {"0,0.5,0.01,0.4,0.02", "0.01,0.6,0.02,0.45,0.03"}));
  EXPECT_THAT(trial.notices, IsEmpty());
  EXPECT_THAT(trial.joints.names, ElementsAre("elbow", "rail"));
  EXPECT_THAT(trial.measured_joints.names, ElementsAre("elbow", "rail"));
  EXPECT_EQ(trial.measured_joints.values(1, 0), 0.45);
  EXPECT_THAT(trial.prismatic_joints, ElementsAre("rail"));
}

TEST(ReadCsv, TakesByteOrderMarkCrLfQuotesAndBlankLines) {
  const Trial plain = MustRead(Csv(kToolHeader, ToolRows(2)));
  const Trial odd = MustRead(
      "\xEF\xBB\xBF\r\n# a comment\r\n\"time_s\", \"ee_x_m\",ee_y_m,ee_z_m,ee_qx,ee_qy,ee_qz,"
      "ee_qw\r\n0.00,0.0,\"0.2\", 0.3 ,0,0,0,+1\r\n\r\n0.01,0.1,0.2,0.3,0,0,0,1\r\n");
  EXPECT_TRUE(SameContent(plain, odd));
}

TEST(ReadCsv, TakesSemicolonsWithDecimalCommas) {
  const Trial trial = MustRead("time_s;elbow_rad\n0;1,5\n0,1;2,5\n");
  EXPECT_DOUBLE_EQ(trial.joints.values(1, 0), 2.5);
  EXPECT_DOUBLE_EQ(trial.joints.time_s[1], 0.1);
  EXPECT_THAT(trial.notices, ElementsAre(HasSubstr("decimal comma")));
}

TEST(ReadCsv, NamesAnEmptyFile) {
  EXPECT_THAT(ErrorOf(""), AllOf(StartsWith("trial.csv:"), HasSubstr("is empty")));
  EXPECT_THAT(ErrorOf("\n \n# only a comment\n"), HasSubstr("is empty"));
}

TEST(ReadCsv, NamesAHeaderWithoutRows) {
  EXPECT_THAT(ErrorOf(std::string(kToolHeader) + "\n"),
              AllOf(StartsWith("trial.csv:1:"), HasSubstr("no whole row")));
}

TEST(ReadCsv, NamesABinaryFile) {
  EXPECT_THAT(ErrorOf(std::string("\x89MCAP0\r\n\0\0", 10)), HasSubstr("not a text file"));
}

TEST(ReadCsv, LeavesOutARowThatTheFilesEndCuts) {
  std::string text = Csv(kToolHeader, ToolRows(3));
  text.resize(text.size() - 8);
  const Trial trial = MustRead(text);
  EXPECT_THAT(trial.end_effectors.at(0).time_s, SizeIs(2));
  EXPECT_THAT(trial.notices, ElementsAre(AllOf(StartsWith("trial.csv:4:"), HasSubstr("left out"))));
}

TEST(ReadCsv, ReadsOrRefusesAFileCutAtAnyByte) {
  const std::string text = Csv(kToolHeader, ToolRows(5));
  const std::size_t header = std::string(kToolHeader).size();
  for (std::size_t length = 0; length < text.size(); ++length) {
    const Result<Trial> trial = ReadCsv(text.substr(0, length), "trial.csv");
    if (trial.ok()) {
      EXPECT_TRUE(Validate(*trial).ok());
      EXPECT_GT(length, header);
    } else {
      EXPECT_THAT(trial.error().message, StartsWith("trial.csv:"));
    }
  }
}

TEST(ReadCsv, NamesTheLineWithAWrongNumberOfFields) {
  EXPECT_THAT(ErrorOf("time_s,a_rad\n0,1\n0.1\n0.2,3\n"),
              AllOf(StartsWith("trial.csv:3:"), HasSubstr("1 fields"), HasSubstr("has 2")));
  EXPECT_THAT(ErrorOf("time_s,a_rad\n0,1\n0.1,2,3\n"), StartsWith("trial.csv:3:"));
}

TEST(ReadCsv, NamesLineAndColumnOfWhatIsNoNumber) {
  EXPECT_THAT(ErrorOf("time_s,a_rad\n0,1\n0.1,fast\n"),
              AllOf(StartsWith("trial.csv:3: a_rad:"), HasSubstr("\"fast\" is not a number")));
  EXPECT_THAT(ErrorOf("time_s,a_rad\n0,1\n0.1,1e999\n"), HasSubstr("out of range"));
  EXPECT_THAT(ErrorOf("time_s,a_rad\n0,1\n0.1,4e7\n"),
              AllOf(StartsWith("trial.csv:3: a_rad:"), HasSubstr("beyond 1e6")));
}

struct HeaderCase {
  const char* header;
  const char* message;
};

class RefusesHeader : public ::testing::TestWithParam<HeaderCase> {};

TEST_P(RefusesHeader, NamingTheColumnAndWhatIsExpected) {
  const std::string header = GetParam().header;
  std::string row = "0";
  for (const char c : header) row += c == ',' ? ",0.5" : "";
  EXPECT_THAT(ErrorOf(Csv(header, {row})),
              AllOf(StartsWith("trial.csv:1:"), HasSubstr(GetParam().message)));
}

INSTANTIATE_TEST_SUITE_P(
    ReadCsv, RefusesHeader,
    ::testing::Values(
        HeaderCase{"time_s,ee_x,ee_y_m,ee_z_m", "column \"ee_x\": the unit is missing"},
        HeaderCase{"time_s,ee_x,ee_y_m,ee_z_m", "expected ee_x_m"},
        HeaderCase{"time_s,ee_left_x_mm,ee_left_y_mm", "expected ee_left_x_m"},
        HeaderCase{"time_s,a_rad,object_box_x", "expected object_box_x_m"},
        HeaderCase{"time_s,a_rad,object_box_qx_m", "expected object_box_qx"},
        HeaderCase{"time_s,ee_x_m,ee_y_m,ee_z_m,ee_roll_rad", "a quaternion ee_qx"},
        HeaderCase{"time_s,elbow_deg", "expected elbow_rad"},
        HeaderCase{"time_s,a_rad,tactile_tip", "expected tactile_tip_n"},
        HeaderCase{"time_s,a_rad,wrench_fx", "expected wrench_fx_n"},
        HeaderCase{"time_s,ee_x_m,ee_z_m", "\"ee_y_m\" is missing"},
        HeaderCase{"time_s,ee_x_m,ee_y_m,ee_z_m,ee_qx,ee_qy,ee_qw", "\"ee_qz\" is missing"},
        HeaderCase{"time_s,a_rad,wrench_fx_n,wrench_fy_n", "\"wrench_fz_n\" is missing"},
        HeaderCase{"time_ms,a_rad", "\"time_ms\" has no unit or another one"},
        HeaderCase{"a_rad,b_rad", "no column time_s"},
        HeaderCase{"time_s,a_rad,a_rad", "\"a_rad\" stands twice"},
        HeaderCase{"time_s,object_b_x_m,object_b_y_m,object_b_z_m", "neither joints"}));

TEST(ReadCsv, IgnoresOtherColumnsWithANotice) {
  const Trial trial = MustRead("time_s,a_rad,operator,elbow\n0,1,Ann,20\n0.1,2,Ann,21\n");
  EXPECT_THAT(trial.joints.names, ElementsAre("a"));
  EXPECT_THAT(trial.notices, Contains(HasSubstr("\"operator\"")));
  EXPECT_THAT(trial.notices, Contains(AllOf(HasSubstr("\"elbow\""), HasSubstr("elbow_rad"))));
}

TEST(ReadCsv, KeepsStreamsAtTheirOwnRateWhereCellsAreEmpty) {
  const Trial trial =
      MustRead(Csv("time_s,a_rad,object_b_x_m,object_b_y_m,object_b_z_m,tactile_t_n",
                   {"0,1,1,2,3,", "0.1,2,,,,", "0.2,3,1,2,4,", "0.3,4,,,,"}));
  EXPECT_THAT(trial.joints.time_s, SizeIs(4));
  EXPECT_THAT(trial.FindObject("b")->time_s, ElementsAre(0, 0.2));
  EXPECT_TRUE(trial.tactile.empty());
  EXPECT_THAT(trial.notices, ElementsAre(HasSubstr("tactile_t_n: has no value")));
}

TEST(ReadCsv, RefusesAHalfEmptyPose) {
  EXPECT_THAT(ErrorOf("time_s,ee_x_m,ee_y_m,ee_z_m\n0,1,2,3\n0.1,1,,3\n"),
              StartsWith("trial.csv:3: ee_y_m: is empty"));
}

TEST(ReadCsv, TakesForcesWithoutTorques) {
  const Trial trial =
      MustRead("time_s,a_rad,wrench_fx_n,wrench_fy_n,wrench_fz_n\n0,1,2,3,4\n0.1,1,2,3,4\n");
  EXPECT_THAT(trial.wrench.names, SizeIs(6));
  EXPECT_EQ(trial.wrench.values(1, 2), 4);
  EXPECT_EQ(trial.wrench.values(1, 5), 0);
}

TEST(ReadCsv, RefusesAHandThatIsNotAShare) {
  EXPECT_THAT(ErrorOf("time_s,a_rad,hand_open\n0,1,85\n0.1,1,0\n"),
              AllOf(HasSubstr("hand_open"), HasSubstr("85"), HasSubstr("between 0")));
}

TEST(ReadCsv, RefusesALabelThatIsNoWholeNumber) {
  EXPECT_THAT(ErrorOf("time_s,a_rad,label\n0,1,1\n0.1,1,1.5\n"), HasSubstr("label: 1.5"));
}

TEST(ReadCsv, ReadsTheRealTrials) {
  const char* variable = std::getenv("EXEMPLAR_DATA");
  const std::filesystem::path folder =
      variable != nullptr ? std::filesystem::path(variable)
                          : std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "../shared/data";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no data in " << folder;
  int trials = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".csv") continue;
    std::ostringstream text;
    text << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    const Result<Trial> trial = ReadCsv(text.str(), entry.path().string());
    ASSERT_TRUE(trial.ok()) << trial.error().message;
    const Result<Trial> again = ReadCsv(WriteCsv(*trial), "written.csv");
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_TRUE(SameContent(*trial, *again)) << entry.path();
    ++trials;
  }
  EXPECT_GT(trials, 0);
}

}  // namespace
}  // namespace exemplar::demonstration
