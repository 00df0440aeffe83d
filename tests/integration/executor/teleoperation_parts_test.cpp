// The parts of teleoperation that no thread belongs to: phases, joint map, suit, dead-man.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <utility>

#include "executor/teleoperation_dead_man.hpp"
#include "executor/teleoperation_map.hpp"
#include "executor/teleoperation_phase.hpp"
#include "executor/teleoperation_suit.hpp"
#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::executor {
namespace {

using std::chrono::milliseconds;

// ---------------------------------------------------------------- phases

TEST(TeleoperationPhase, EveryPairIsTakenOrRefusedAsTheTableSays) {
  using P = Phase;
  using E = PhaseEvent;
  const std::map<std::pair<P, E>, P> taken = {
      {{P::kHolding, E::kEngage}, P::kApproaching},   {{P::kHolding, E::kHold}, P::kHolding},
      {{P::kApproaching, E::kArrive}, P::kFollowing}, {{P::kApproaching, E::kBlock}, P::kBlocked},
      {{P::kApproaching, E::kHold}, P::kHolding},     {{P::kFollowing, E::kBlock}, P::kBlocked},
      {{P::kFollowing, E::kHold}, P::kHolding},       {{P::kBlocked, E::kFree}, P::kApproaching},
      {{P::kBlocked, E::kHold}, P::kHolding},
  };
  for (const Phase phase : kAllPhases) {
    for (const PhaseEvent event : kAllPhaseEvents) {
      const auto expected = taken.find({phase, event});
      const std::optional<Phase> next = Next(phase, event);
      EXPECT_EQ(next.has_value(), expected != taken.end())
          << ToString(phase) << ", " << ToString(event);
      if (next && expected != taken.end()) {
        EXPECT_EQ(ToString(*next), ToString(expected->second));
      }
    }
  }
}

// ---------------------------------------------------------------- joint map

const std::vector<std::string> kJoints = {"shoulder", "elbow", "wrist"};

TEST(JointMap, SameNamesDriveUnlessAnEntrySaysOtherwise) {
  const auto map =
      JointMap::Parse("joints:\n  - {suit: RightElbow, robot: elbow, scale: -2, offset: 0.5}\n",
                      "suit.yaml", kJoints);
  ASSERT_TRUE(map.ok()) << map.error().message;
  const auto bindings = map->Bind({"wrist", "elbow", "RightElbow", "toe"});
  ASSERT_EQ(bindings.size(), 2U);
  EXPECT_EQ(bindings[0].joint, 1);
  EXPECT_EQ(bindings[0].place, 2);
  EXPECT_EQ(bindings[0].scale, -2);
  EXPECT_EQ(bindings[0].offset, 0.5);
  EXPECT_EQ(bindings[1].joint, 2);
  EXPECT_EQ(bindings[1].place, 0);
  // A suit without the joint of the entry still has that of the same name.
  EXPECT_EQ(map->Bind({"elbow"}).size(), 1U);
  const auto none = JointMap::Parse("same_names: false\n", "suit.yaml", kJoints);
  ASSERT_TRUE(none.ok());
  EXPECT_TRUE(none->Bind({"wrist", "elbow"}).empty());
}

TEST(JointMap, ErrorsNameFileLineAndEntry) {
  const std::pair<const char*, std::vector<std::string>> faults[] = {
      {"joints:\n  - {suit: RightElbow, robot: elbo}\n",
       {"suit.yaml:2", "joints[0] (\"RightElbow\")", "\"elbo\"", "did you mean \"elbow\""}},
      {"joints:\n  - {suit: a, robot: elbow}\n  - {suit: b, robot: elbow}\n",
       {"suit.yaml:3", "joints[1] (\"b\")", "\"a\""}},
      {"joints:\n  - {suit: a, robot: elbow, scale: fast}\n",
       {"suit.yaml:2", "joints[0].scale", "\"fast\""}},
      {"joints:\n  - {suit: a, robot: elbow, scale: 0}\n", {"suit.yaml:2", "scale", "not be 0"}},
      {"joints:\n  - {suit: a, robot: elbow, offset: .nan}\n", {"suit.yaml:2", "offset"}},
      {"joints:\n  - {robot: elbow}\n", {"suit.yaml:2", "joints[0]", "\"suit\""}},
      {"joints:\n  - {suit: a, robot: elbow, gain: 2}\n", {"suit.yaml:2", "\"gain\""}},
      {"joints: 7\n", {"suit.yaml:1", "joints", "list"}},
      {"same_names: maybe\n", {"suit.yaml:1", "same_names", "\"maybe\""}},
      {"- 1\n", {"suit.yaml:1", "map"}},
      {"joints: [\n", {"suit.yaml:"}},
  };
  for (const auto& [text, parts] : faults) {
    const auto map = JointMap::Parse(text, "suit.yaml", kJoints);
    ASSERT_FALSE(map.ok()) << text;
    for (const std::string& part : parts) {
      EXPECT_NE(map.error().message.find(part), std::string::npos)
          << map.error().message << " lacks " << part;
    }
  }
}

TEST(JointMap, LeonardosSuitDrivesItsNineJoints) {
  const std::filesystem::path folder =
      std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "deploy" / "models" / "leonardo";
  const auto robot = kinematics::ReadRobotDescription(folder);
  ASSERT_TRUE(robot.ok());
  const auto map = JointMap::Read(folder / "suit.yaml", robot->chain.joint_names());
  ASSERT_TRUE(map.ok()) << map.error().message;
  std::vector<std::string> suit = {"left wrist in/out",        "torso rotation",
                                   "hip front/back",           "hip side/side",
                                   "right shoulder in/out",    "right shoulder forward/backward",
                                   "right upper-arm rotation", "right elbow in/out",
                                   "right forearm rotation",   "right wrist in/out"};
  while (suit.size() < 42) suit.push_back("other " + std::to_string(suit.size()));
  EXPECT_EQ(map->Bind(suit).size(), 9U);
}

/// Of a small motion of one joint at home: the tool's, metres, and a third of a metre for a radian.
Eigen::Matrix<double, 6, 1> ToolMotion(const kinematics::RobotDescription& robot, int joint) {
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, robot.chain.dof());
  (void)robot.chain.ToolPoseAndJacobian(robot.home, jacobian);
  Eigen::Matrix<double, 6, 1> motion = jacobian.col(joint);
  motion.tail<3>() /= 3;
  return motion;
}

TEST(JointMap, AToolGoesWhereTheOperatorsHandGoesWhateverTheRobot) {
  const std::filesystem::path models =
      std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "deploy" / "models";
  const auto person = kinematics::ReadRobotDescription(models / "leonardo");
  ASSERT_TRUE(person.ok());
  const std::vector<std::string> suit = {"torso rotation",
                                         "hip front/back",
                                         "hip side/side",
                                         "right shoulder in/out",
                                         "right shoulder forward/backward",
                                         "right upper-arm rotation",
                                         "right elbow in/out",
                                         "right forearm rotation",
                                         "right wrist in/out"};
  for (const auto& [model, driven] : {std::pair("arm7", 6U), std::pair("ur5e_like", 5U)}) {
    const auto robot = kinematics::ReadRobotDescription(models / model);
    ASSERT_TRUE(robot.ok());
    const auto map = JointMap::Read(models / model / "suit.yaml", robot->chain.joint_names());
    ASSERT_TRUE(map.ok()) << map.error().message;
    const auto bindings = map->Bind(suit);
    EXPECT_EQ(bindings.size(), driven) << model;
    for (const JointMap::Binding& binding : bindings) {
      const std::string place = std::string(model) + ": " + suit[std::size_t(binding.place)];
      // Joints of the suit stand in the order of the body's.
      EXPECT_NEAR(binding.scale * person->home[binding.place] + binding.offset,
                  robot->home[binding.joint], 1e-4)
          << place;
      const Eigen::Matrix<double, 6, 1> hand = ToolMotion(*person, binding.place);
      const Eigen::Matrix<double, 6, 1> tool =
          std::copysign(1.0, binding.scale) * ToolMotion(*robot, binding.joint);
      EXPECT_GT(hand.normalized().dot(tool.normalized()), 0.5) << place;
    }
  }
}

// ---------------------------------------------------------------- suit

class SuitTest : public ::testing::Test {
 protected:
  static std::vector<kinematics::JointLimits> Limits() {
    kinematics::JointLimits joint;
    joint.lower = -3;
    joint.upper = 3;
    joint.velocity = 2;
    joint.acceleration = 10;
    return std::vector<kinematics::JointLimits>(kJoints.size(), joint);
  }
  SuitTest() : intake_(JointMap(kJoints), Limits()) { intake_.Begin(""); }

  std::optional<SuitPosture> Take(double elbow, Duration at, Duration delay = Duration::zero(),
                                  const std::string& source = "suit",
                                  const std::string& writer = "w") {
    ircp::SuitSample sample;
    sample.header.source = source;
    sample.header.stamp = Stamp::FromNanoseconds((at - delay).count());
    sample.names = {"toe", "elbow"};
    sample.positions = {7, elbow};
    return intake_.Take(sample, writer, at);
  }

  SuitIntake intake_;
};

TEST_F(SuitTest, MapsJointsAndTellsTheirVelocity) {
  std::optional<SuitPosture> posture;
  for (int k = 0; k < 5; ++k) posture = Take(0.02 * k, milliseconds(20 * k));
  ASSERT_TRUE(posture);
  EXPECT_EQ(posture->fault, SuitFault::kNone);
  EXPECT_EQ(posture->driven.count(), 1U);
  EXPECT_TRUE(posture->driven[1]);
  EXPECT_NEAR(posture->positions[1], 0.08, 1e-12);
  EXPECT_NEAR(posture->velocities[1], 1.0, 1e-9);
  EXPECT_EQ(posture->interval, milliseconds(20));
}

TEST_F(SuitTest, FindsJumpsAndGoesOnFromThere) {
  for (int k = 0; k < 3; ++k) Take(0, milliseconds(20 * k));
  const auto jump = Take(1, milliseconds(60));
  ASSERT_TRUE(jump);
  EXPECT_EQ(jump->fault, SuitFault::kJump);
  EXPECT_EQ(jump->joint, 1);
  EXPECT_NEAR(jump->way, 1, 1e-12);
  const auto after = Take(1.001, milliseconds(80));
  ASSERT_TRUE(after);
  EXPECT_EQ(after->fault, SuitFault::kNone);
}

TEST_F(SuitTest, LeavesOutWhatIsLateRepeatedOrOfAnotherSuit) {
  EXPECT_TRUE(Take(0, milliseconds(0), milliseconds(5)));
  EXPECT_FALSE(Take(0, milliseconds(500), milliseconds(200))) << "195 ms later than the first";
  EXPECT_TRUE(Take(0, milliseconds(520), milliseconds(5)));
  EXPECT_FALSE(Take(0, milliseconds(530), milliseconds(15))) << "the same moment once more";
  EXPECT_FALSE(Take(0, milliseconds(540), milliseconds(5), "another"));
  EXPECT_FALSE(Take(0, milliseconds(550), milliseconds(5), "suit", "other writer"));
  EXPECT_EQ(intake_.left_out(), 4U);
  intake_.ForgetDelay();
  EXPECT_TRUE(Take(0, milliseconds(900), milliseconds(300))) << "judged anew after a press";
}

TEST_F(SuitTest, TellsSuitsThatDriveNothingAndNumbersThatAreNone) {
  ircp::SuitSample sample;
  sample.header.source = "suit";
  sample.header.stamp = Stamp::FromNanoseconds(1);
  sample.names = {"toe"};
  sample.positions = {0};
  EXPECT_EQ(intake_.Take(sample, "w", milliseconds(1))->fault, SuitFault::kUnknown);
  sample.header.stamp = Stamp::FromNanoseconds(2);
  sample.names = {"elbow"};
  sample.positions = {std::numeric_limits<double>::quiet_NaN()};
  const auto posture = intake_.Take(sample, "w", milliseconds(2));
  EXPECT_EQ(posture->fault, SuitFault::kNotFinite);
  EXPECT_EQ(posture->joint, 1);
}

// ---------------------------------------------------------------- dead-man

class DeadManTest : public ::testing::Test {
 protected:
  bool Say(const std::string& who, bool held, int at_ms, bool emergency = false) {
    ircp::SafetySample sample;
    sample.header.source = who;
    sample.header.stamp = Stamp::FromNanoseconds(1000 + at_ms);
    sample.dead_man_held = held;
    sample.emergency_stop = emergency;
    return dead_man_.Take(sample, milliseconds(at_ms));
  }
  DeadMan dead_man_{milliseconds(250)};
};

TEST_F(DeadManTest, CountsAPressAfterItWasHeardReleased) {
  EXPECT_FALSE(Say("suit", true, 0)) << "held from the first sample on";
  EXPECT_FALSE(Say("suit", true, 50));
  EXPECT_FALSE(dead_man_.held());
  EXPECT_FALSE(Say("suit", false, 100));
  EXPECT_EQ(dead_man_.pressed(), Stamp());
  EXPECT_TRUE(Say("suit", true, 150));
  EXPECT_TRUE(dead_man_.held());
  EXPECT_TRUE(dead_man_.heard(milliseconds(400)));
  EXPECT_FALSE(dead_man_.heard(milliseconds(401)));
  EXPECT_FALSE(Say("suit", true, 380));
  EXPECT_FALSE(Say("suit", false, 420));
  EXPECT_FALSE(dead_man_.held());
  EXPECT_EQ(dead_man_.pressed(), Stamp::FromNanoseconds(1150)) << "on the presser's own clock";
}

TEST_F(DeadManTest, DoesNotComeBackByItselfAfterASilence) {
  Say("suit", false, 0);
  Say("suit", true, 50);
  EXPECT_FALSE(Say("suit", true, 1000));
  EXPECT_FALSE(dead_man_.held());
  Say("suit", false, 1050);
  EXPECT_TRUE(Say("suit", true, 1100));
}

TEST_F(DeadManTest, BelongsToWhoPressedIt) {
  Say("panel", false, 0);
  Say("suit", false, 0);
  EXPECT_TRUE(Say("suit", true, 50));
  EXPECT_FALSE(Say("panel", false, 60)) << "another one that is not held changes nothing";
  EXPECT_TRUE(dead_man_.held());
  EXPECT_FALSE(Say("panel", true, 100)) << "and does not take it over";
  Say("suit", false, 110);
  EXPECT_FALSE(dead_man_.held()) << "though the panel's is held";
  EXPECT_EQ(dead_man_.presses(), 1U);
}

TEST_F(DeadManTest, AnEmergencyStopReleasesIt) {
  Say("suit", false, 0);
  Say("suit", true, 50);
  Say("suit", true, 60, true);
  EXPECT_FALSE(dead_man_.held());
}

}  // namespace
}  // namespace exemplar::executor
