#include "exemplar/kinematics/srdf.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::kinematics {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

RobotModel Arm() {
  return *ParseUrdf(R"(<robot name="arm"><link name="base"/><link name="upper"/><link name="lower"/>
    <joint name="a" type="fixed"><parent link="base"/><child link="upper"/></joint>
    <joint name="b" type="fixed"><parent link="upper"/><child link="lower"/></joint></robot>)",
                    "arm.urdf");
}

std::string ErrorOf(const std::string& inside) {
  const Result<LinkPairs> read =
      ParseSrdf("<robot name=\"arm\">\n" + inside + "\n</robot>", "arm.srdf", Arm());
  return read.ok() ? "no error" : read.error().message;
}

TEST(Srdf, GivesThePairsSortedAndOnce) {
  const Result<LinkPairs> read = ParseSrdf(R"(<robot name="arm">
    <group name="all"><chain base_link="base" tip_link="lower"/></group>
    <disable_collisions link1="upper" link2="base" reason="Adjacent"/>
    <disable_collisions link1="base" link2="upper" reason="Never"/>
    <disable_collisions link1="lower" link2="upper"/>
  </robot>)",
                                           "arm.srdf", Arm());
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_THAT(*read, ElementsAre(Pair("base", "upper"), Pair("lower", "upper")));
}

TEST(Srdf, EnablesWhatADefaultDisables) {
  const Result<LinkPairs> read = ParseSrdf(R"(<robot name="arm">
    <disable_default_collisions link="base"/>
    <enable_collisions link1="base" link2="lower"/></robot>)",
                                           "arm.srdf", Arm());
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_THAT(*read, ElementsAre(Pair("base", "upper")));
}

TEST(Srdf, ErrorsNameFileLineAndElement) {
  EXPECT_THAT(ErrorOf("<disable_collisions link1=\"base\" link2=\"uper\"/>"),
              AllOf(HasSubstr("arm.srdf:2"), HasSubstr("<disable_collisions>"),
                    HasSubstr("\"uper\""), HasSubstr("did you mean \"upper\"")));
  EXPECT_THAT(ErrorOf("<disable_collisions link1=\"base\"/>"),
              AllOf(HasSubstr("arm.srdf:2"), HasSubstr("link2 is missing")));
  EXPECT_THAT(ErrorOf("\n<disable_colisions link1=\"base\" link2=\"upper\"/>"),
              AllOf(HasSubstr("arm.srdf:3"), HasSubstr("did you mean <disable_collisions>")));
  EXPECT_THAT(ErrorOf("<disable_collisions link1=\"base\" link2=\"base\"/>"),
              HasSubstr("both \"base\""));
  EXPECT_THAT(ErrorOf("<disable_default_collisions link=\"tail\"/>"), HasSubstr("\"tail\""));
  EXPECT_THAT(ErrorOf("<group>"), HasSubstr("arm.srdf:"));
  EXPECT_THAT(ErrorOf("</robot><robot>"), HasSubstr("arm.srdf:"));
}

TEST(Srdf, RefusesAnotherRobotsFileAndForeignXml) {
  const auto error = [](const char* text) {
    const Result<LinkPairs> read = ParseSrdf(text, "x.srdf", Arm());
    return read.ok() ? std::string("no error") : read.error().message;
  };
  EXPECT_THAT(error("<robot name=\"leg\"/>"), AllOf(HasSubstr("\"leg\""), HasSubstr("\"arm\"")));
  EXPECT_THAT(error("<robot/>"), HasSubstr("name is missing"));
  EXPECT_THAT(error("<sdf/>"), HasSubstr("must be <robot>"));
  EXPECT_THAT(error(""), HasSubstr("x.srdf"));
  EXPECT_THAT(error("not xml"), HasSubstr("x.srdf"));
  EXPECT_FALSE(ReadSrdf("/nowhere/x.srdf", Arm()).ok());
}

TEST(Srdf, OfARobotsFolderReplacesTheSampling) {
  namespace fs = std::filesystem;
  const fs::path from = fs::path(EXEMPLAR_SOURCE_DIR) / "deploy/models/arm7";
  const fs::path folder = fs::path(::testing::TempDir()) / "exemplar_srdf_test";
  fs::remove_all(folder);
  fs::copy(from, folder);
  EXPECT_FALSE(ReadRobotDescription(folder)->allowed_pairs.has_value());
  std::ofstream(folder / "robot.yaml", std::ios::app) << "srdf: arm7.srdf\n";
  const Result<RobotDescription> without = ReadRobotDescription(folder);
  ASSERT_FALSE(without.ok());
  EXPECT_THAT(without.error().message, HasSubstr("arm7.srdf"));
  const RobotModel model = ReadRobotDescription(from)->model;
  std::ofstream(folder / "arm7.srdf")
      << "<robot name=\"" << model.name << "\">\n<disable_collisions link1=\""
      << model.links[0].name << "\" link2=\"" << model.links[3].name << "\"/>\n</robot>\n";
  const Result<RobotDescription> with = ReadRobotDescription(folder);
  ASSERT_TRUE(with.ok()) << with.error().message;
  ASSERT_TRUE(with->allowed_pairs.has_value());
  EXPECT_EQ(with->allowed_pairs->size(), 1U);
  const collision::CheckerOptions options = collision::OptionsOf(*with);
  EXPECT_EQ(options.allowed_pairs, *with->allowed_pairs);
  EXPECT_EQ(options.sampled_allowed_states, 0);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace exemplar::kinematics
