#include "exemplar/kinematics/robot_description.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "robots.hpp"

namespace exemplar::kinematics {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class RobotFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::path(::testing::TempDir()) /
        (std::string("robot_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "two.urdf") << testing::TwoLinkRobot();
  }
  Result<RobotDescription> Read(const std::string& yaml) {
    std::ofstream(folder_ / "robot.yaml") << yaml;
    return ReadRobotDescription(folder_);
  }
  std::string ErrorOf(const std::string& yaml) {
    const Result<RobotDescription> robot = Read(yaml);
    return robot.ok() ? "no error" : robot.error().message;
  }
  std::filesystem::path folder_;
};

TEST_F(RobotFolder, HoldsWhatTheUrdfCannotSay) {
  const Result<RobotDescription> robot = Read(
      "urdf: two.urdf\nbase: ground\ntip: tool\ntouch_links: [lower]\n"
      "home: {first: 0.5, second: -1}\n"
      "acceleration: {default: 4, second: 7}\n"
      "jerk: {second: 90}\n"
      "servo: {default: {stiffness: 100}, second: {stiffness: 50, damping: 3}}\n");
  ASSERT_TRUE(robot.ok()) << robot.error().message;
  EXPECT_EQ(robot->name, "two");
  EXPECT_EQ(robot->home, Eigen::Vector2d(0.5, -1));
  EXPECT_THAT(robot->touch_links, ElementsAre("lower"));
  EXPECT_EQ(robot->chain.limits()[0].acceleration, 4);
  EXPECT_EQ(robot->chain.limits()[1].acceleration, 7);
  EXPECT_EQ(robot->model.joints[robot->model.FindJoint("second")].limits.acceleration, 7);
  EXPECT_EQ(robot->chain.limits()[0].jerk, kDefaultJerk);
  EXPECT_EQ(robot->chain.limits()[1].jerk, 90);
  EXPECT_EQ(robot->servo[0].stiffness, 100);
  EXPECT_EQ(robot->servo[0].damping, ServoGains{}.damping);
  EXPECT_EQ(robot->servo[1].damping, 3);
}

TEST_F(RobotFolder, NamesFileLineAndKeyOfWhatIsWrong) {
  const std::string good = "urdf: two.urdf\nhome: {first: 0, second: 0}\n";
  EXPECT_EQ(ErrorOf(good), "no error");
  EXPECT_THAT(ErrorOf(good + "hoem: 1\n"),
              AllOf(HasSubstr("robot.yaml:3:"), HasSubstr("did you mean \"home\"?")));
  EXPECT_THAT(ErrorOf("urdf: two.urdf\nhome: {first: 0}\n"),
              AllOf(HasSubstr("robot.yaml:2:"), HasSubstr("joint \"second\" is missing")));
  EXPECT_THAT(ErrorOf("urdf: two.urdf\nhome:\n  first: 0\n  second: 9\n"),
              AllOf(HasSubstr("robot.yaml:4:"), HasSubstr("home.second is 9, outside its limits")));
  EXPECT_THAT(ErrorOf("urdf: two.urdf\nhome: {first: x, second: 0}\n"), HasSubstr("is \"x\","));
  EXPECT_THAT(ErrorOf("urdf: two.urdf\nhome: {frist: 0, second: 0}\n"),
              HasSubstr("did you mean \"first\"?"));
  EXPECT_THAT(ErrorOf(good + "tip: tol\n"),
              AllOf(HasSubstr("robot.yaml:3:"), HasSubstr("did you mean \"tool\"?")));
  EXPECT_THAT(ErrorOf(good + "acceleration: {first: -1}\n"), HasSubstr("must be positive"));
  EXPECT_THAT(ErrorOf(good + "servo: {first: {stifness: 1}}\n"),
              HasSubstr("did you mean \"stiffness\"?"));
  EXPECT_THAT(ErrorOf(good + "touch_links: [lowr]\n"), HasSubstr("did you mean \"lower\"?"));
  EXPECT_THAT(ErrorOf("urdf: three.urdf\n"), HasSubstr("three.urdf: cannot be read"));
  EXPECT_THAT(ErrorOf("home: {}\n"), HasSubstr("urdf is missing"));
  EXPECT_THAT(ErrorOf("urdf: [\n"), HasSubstr("robot.yaml:"));
  EXPECT_THAT(ErrorOf("- 1\n"), HasSubstr("must hold keys"));
  EXPECT_THAT(ErrorOf(""), HasSubstr("must hold keys"));
}

TEST(ReadRobotDescription, SaysWhichFolderHasNoRobot) {
  const Result<RobotDescription> robot = ReadRobotDescription("/nowhere");
  ASSERT_FALSE(robot.ok());
  EXPECT_EQ(robot.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(robot.error().message, HasSubstr("/nowhere/robot.yaml"));
}

TEST(FullJointVector, DerivesMimicJointsAndRestsTheOthers) {
  const RobotModel model = testing::Parse(testing::MixedRobot());
  const Chain chain = testing::ChainOf(model);
  const Eigen::VectorXd full = FullJointVector(model, chain, Eigen::Vector3d(0.1, 2, 0.4));
  EXPECT_EQ(full[model.FindJoint("slide")], 0.1);
  EXPECT_DOUBLE_EQ(full[model.FindJoint("follow")], -0.5 * 0.4 + 0.1);
  EXPECT_EQ(full[model.FindJoint("other")], 0);
}

TEST(Hand, IsReadFromTheModelsFolder) {
  const Result<RobotDescription> robot =
      ReadRobotDescription(EXEMPLAR_SOURCE_DIR "/deploy/models/arm7_hand");
  ASSERT_TRUE(robot.ok()) << robot.error().message;
  ASSERT_TRUE(robot->model.hand.has_value());
  const Hand& hand = *robot->model.hand;
  const int left = robot->model.FindJoint("left_finger");
  const int right = robot->model.FindJoint("right_finger");
  EXPECT_EQ(hand.joint, left);
  EXPECT_EQ(robot->model.joints[left].limits.effort, 30);
  EXPECT_EQ(robot->hand_servo.stiffness, 3000);
  EXPECT_DOUBLE_EQ(hand.OpeningAt(hand.PositionAt(0.3)), 0.3);
  Eigen::VectorXd full = FullJointVector(robot->model, robot->chain, robot->home);
  EXPECT_EQ(full[left], 0.04) << "open";
  EXPECT_EQ(full[right], 0.04);
  SetHandOpening(robot->model, 0.25, full);
  EXPECT_DOUBLE_EQ(full[left], 0.01);
  EXPECT_DOUBLE_EQ(full[right], 0.01) << "it follows";
  SetHandOpening(robot->model, 7, full);
  EXPECT_DOUBLE_EQ(full[left], 0.04);
}

TEST_F(RobotFolder, RefusesHandsThatCannotOpen) {
  const std::string good = "urdf: two.urdf\nbase: ground\ntip: tool\nhome: {first: 0, second: 0}\n";
  EXPECT_THAT(ErrorOf(good + "hand: {joint: frist, closed: 0, open: 1}\n"),
              AllOf(HasSubstr("robot.yaml:5"), HasSubstr("first")));
  EXPECT_THAT(ErrorOf(good + "hand: {joint: first, closed: 0, open: 1}\n"),
              HasSubstr("not belong to the chain"));
  EXPECT_THAT(ErrorOf(good + "hand: {closed: 0, open: 1}\n"), HasSubstr("hand.joint"));
  EXPECT_THAT(ErrorOf(good + "hand: [first]\n"), HasSubstr("hand must hold"));
  EXPECT_THAT(ErrorOf(good + "hand: {joint: first, shut: 0}\n"), HasSubstr("unknown key"));
}

}  // namespace
}  // namespace exemplar::kinematics
