// The parts of teleoperation that no thread belongs to: phases, joint map, suit, dead-man, steps.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <utility>

#include "allocation_count.hpp"
#include "executor/teleoperation_dead_man.hpp"
#include "executor/teleoperation_map.hpp"
#include "executor/teleoperation_motion.hpp"
#include "executor/teleoperation_phase.hpp"
#include "executor/teleoperation_suit.hpp"
#include "exemplar/base/rng.hpp"

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
  EXPECT_TRUE(Say("suit", true, 150));
  EXPECT_TRUE(dead_man_.held());
  EXPECT_TRUE(dead_man_.heard(milliseconds(400)));
  EXPECT_FALSE(dead_man_.heard(milliseconds(401)));
  EXPECT_FALSE(Say("suit", false, 420));
  EXPECT_FALSE(dead_man_.held());
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

// ---------------------------------------------------------------- steps

constexpr double kStep_s = 0.008;

/// arm7 above a table, an operator beside it, no thread.
class StepTest : public ::testing::Test {
 protected:
  StepTest()
      : robot_(*kinematics::ReadRobotDescription(std::filesystem::path(EXEMPLAR_SOURCE_DIR) /
                                                 "deploy" / "models" / "arm7")),
        operator_(robot_.home),
        full_(kinematics::FullJointVector(robot_.model, robot_.chain, robot_.home)) {
    scene_.objects.push_back({"table", geometry::Pose::FromTranslation({0.5, 0, -0.02}),
                              kinematics::Box{{1.4, 1.4, 0.03}}});
    scene_.objects.push_back({"post", geometry::Pose::FromTranslation({0.35, 0.45, 0.3}),
                              kinematics::Cylinder{0.04, 0.6}});
    motion_ = Make();
    motion_->Begin(robot_.home, 0);
  }

  std::unique_ptr<collision::CollisionChecker> Checker() const {
    return std::make_unique<collision::CollisionChecker>(
        *collision::CollisionChecker::Create(robot_.model, scene_, collision::OptionsOf(robot_)));
  }
  std::unique_ptr<TeleoperationMotion> Make() const {
    return std::make_unique<TeleoperationMotion>(robot_, Checker(),
                                                 std::vector<collision::AllowedTouch>{}, options_);
  }

  void Press() {
    ++input_.presses;
    input_.dead_man_held = true;
  }

  /// The operator's sample, and the step that follows it.
  void Step() {
    input_.now += FromSeconds(kStep_s);
    input_.elapsed_s = kStep_s;
    if (suit_speaks_) {
      SuitPosture posture;
      for (int j = 0; j < robot_.chain.dof(); ++j) {
        posture.positions[static_cast<std::size_t>(j)] = operator_[j];
        posture.velocities[static_cast<std::size_t>(j)] = operator_velocity_[j];
        if (j != silent_joint_) posture.driven.set(static_cast<std::size_t>(j));
      }
      posture.received = input_.now;
      posture.interval = FromSeconds(kStep_s);
      posture.fault = fault_;
      posture.joint = 2;
      motion_->Take(posture);
    }
    const Setpoint& setpoint = motion_->Step(input_);
    for (int j = 0; j < robot_.chain.dof(); ++j) {
      commanded_[j] = setpoint.positions[static_cast<std::size_t>(j)];
    }
    if (!motion_->changes().empty()) last_change_ = motion_->changes().back();
  }
  void Steps(int count) {
    for (int i = 0; i < count; ++i) Step();
  }
  void Follow() {
    Press();
    Steps(10);
    ASSERT_EQ(motion_->phase(), Phase::kFollowing);
  }
  double Clearance() {
    for (int j = 0; j < robot_.chain.dof(); ++j) {
      full_[robot_.chain.joint_indices()[j]] = commanded_[j];
    }
    return truth_->SmallestDistance(full_);
  }

  kinematics::RobotDescription robot_;
  TeleoperationOptions options_;
  collision::Scene scene_;
  std::unique_ptr<TeleoperationMotion> motion_;
  std::unique_ptr<collision::CollisionChecker> truth_;
  StepInput input_{Duration::zero(), kStep_s, true, false, true, 0, 1};
  Eigen::VectorXd operator_;
  Eigen::VectorXd operator_velocity_ = Eigen::VectorXd::Zero(robot_.chain.dof());
  Eigen::VectorXd commanded_ = robot_.home;
  Eigen::VectorXd full_;
  bool suit_speaks_ = true;
  int silent_joint_ = -1;
  SuitFault fault_ = SuitFault::kNone;
  PhaseChange last_change_;
};

TEST_F(StepTest, HoldsUntilTheDeadManIsPressed) {
  operator_[1] += 0.3;
  Steps(100);
  EXPECT_EQ(motion_->phase(), Phase::kHolding);
  EXPECT_EQ(commanded_, robot_.home);
}

TEST_F(StepTest, ApproachesSlowlyAndThenFollows) {
  operator_[1] += 0.5;
  Press();
  Eigen::VectorXd before = commanded_;
  double fastest = 0;
  int steps = 0;
  while (motion_->phase() != Phase::kFollowing && steps++ < 1000) {
    Step();
    fastest = std::max(fastest, std::abs(commanded_[1] - before[1]) / kStep_s);
    before = commanded_;
  }
  ASSERT_EQ(motion_->phase(), Phase::kFollowing);
  EXPECT_LE(fastest, 1.05 * options_.approach_share * robot_.chain.limits()[1].velocity);
  EXPECT_NEAR(commanded_[1], operator_[1], options_.near_rad + 1e-9);
  Steps(200);
  EXPECT_NEAR(commanded_[1], operator_[1], 1e-3);
}

TEST_F(StepTest, RefusesAPostureThatIsFarAway) {
  operator_[0] += 1.5;
  Press();
  Steps(200);
  EXPECT_EQ(motion_->phase(), Phase::kHolding);
  EXPECT_EQ(last_change_.reason, HoldReason::kTooFar);
  EXPECT_EQ(last_change_.joint, 0);
  EXPECT_NEAR(last_change_.value, 1.5, 1e-9);
  EXPECT_EQ(commanded_, robot_.home);
  operator_[0] -= 1.5;
  Steps(20);
  EXPECT_EQ(motion_->phase(), Phase::kHolding) << "until the dead-man is pressed again";
  Follow();
}

TEST_F(StepTest, HoldsWhenTheDeadManGoesAndDoesNotComeBackByItself) {
  Follow();
  operator_velocity_[1] = 0.4;
  for (int i = 0; i < 50; ++i) {
    operator_[1] += operator_velocity_[1] * kStep_s;
    Step();
  }
  input_.dead_man_held = false;
  Step();
  EXPECT_EQ(motion_->phase(), Phase::kHolding);
  EXPECT_EQ(last_change_.reason, HoldReason::kReleased);
  Steps(75);
  EXPECT_TRUE(motion_->resting());
  const Eigen::VectorXd held = commanded_;
  input_.dead_man_held = true;  // without a press
  Steps(50);
  EXPECT_EQ(commanded_, held);
}

TEST_F(StepTest, HoldsForEachFaultOfTheSuitAndNamesIt) {
  const std::pair<SuitFault, HoldReason> faults[] = {
      {SuitFault::kUnknown, HoldReason::kSuitUnknown},
      {SuitFault::kNotFinite, HoldReason::kSuitNotFinite},
      {SuitFault::kJump, HoldReason::kSuitJumps}};
  for (const auto& [fault, reason] : faults) {
    Follow();
    fault_ = fault;
    Step();
    EXPECT_EQ(motion_->phase(), Phase::kHolding);
    EXPECT_EQ(last_change_.reason, reason);
    fault_ = SuitFault::kNone;
    Steps(50);
    EXPECT_EQ(motion_->phase(), Phase::kHolding) << "until the dead-man is pressed again";
  }
  fault_ = SuitFault::kUnknown;
  Press();
  Steps(20);
  suit_speaks_ = false;
  Steps(5);
  suit_speaks_ = true;
  Steps(60);
  EXPECT_EQ(last_change_.reason, HoldReason::kSuitUnknown) << "the reason is not that of a silence";
  fault_ = SuitFault::kNone;
  Follow();
  suit_speaks_ = false;
  int steps = 0;
  while (motion_->phase() == Phase::kFollowing && steps++ < 100) Step();
  EXPECT_EQ(last_change_.reason, HoldReason::kSuitSilent);
  EXPECT_NEAR(steps * kStep_s, ToSeconds(options_.suit_patience), 2 * kStep_s);
  suit_speaks_ = true;
  Steps(20);
  Follow();
  silent_joint_ = 3;
  Step();
  EXPECT_EQ(last_change_.reason, HoldReason::kSuitLostJoint);
  EXPECT_EQ(last_change_.joint, 3);
  silent_joint_ = -1;
  Steps(20);
  Follow();
  input_.dead_man_heard = false;
  Step();
  EXPECT_EQ(last_change_.reason, HoldReason::kDeadManSilent);
}

TEST_F(StepTest, JointsThatNothingDrivesStayWhereTheyAre) {
  silent_joint_ = 2;
  operator_[2] += 0.4;
  operator_[1] += 0.2;
  Press();
  Steps(300);
  EXPECT_EQ(motion_->phase(), Phase::kFollowing);
  EXPECT_NEAR(commanded_[1], operator_[1], 1e-3);
  EXPECT_NEAR(commanded_[2], robot_.home[2], 1e-9);
}

TEST_F(StepTest, StopsAtTheClearanceAndComesBackOutWhenTheOperatorDrawsBack) {
  truth_ = Checker();
  Follow();
  // Down into the table, as quickly as the suit may.
  double smallest = 1;
  const double speed = 1.0;
  operator_velocity_[1] = speed;
  const double begin = operator_[1];
  for (int i = 0; i < 190; ++i) {
    operator_[1] = begin + speed * kStep_s * std::min(i, 140);
    if (i == 140) operator_velocity_.setZero();
    Step();
    smallest = std::min(smallest, Clearance());
  }
  for (int i = 0; i < 1500 && motion_->phase() != Phase::kBlocked; ++i) {
    Step();
    smallest = std::min(smallest, Clearance());
  }
  EXPECT_EQ(motion_->phase(), Phase::kBlocked);
  EXPECT_GE(smallest, options_.clearance_m - 1e-4);
  EXPECT_LT(Clearance(), options_.clearance_m + 0.01) << "it went as far as it may";
  operator_velocity_.setZero();
  operator_[1] = begin;
  for (int i = 0; i < 800 && motion_->phase() != Phase::kFollowing; ++i) Step();
  EXPECT_EQ(motion_->phase(), Phase::kFollowing);
  Steps(100);
  EXPECT_NEAR(commanded_[1], begin, 1e-2);
}

TEST_F(StepTest, NeverComesNearerThanTheClearanceHoweverTheOperatorMoves) {
  truth_ = Checker();
  Rng rng(5);
  double smallest = 1;
  Follow();
  Eigen::VectorXd goal = operator_;
  for (int i = 0; i < 4000; ++i) {
    if (i % 60 == 0) {
      for (int j = 0; j < robot_.chain.dof(); ++j) {
        const kinematics::JointLimits& range = robot_.chain.limits()[static_cast<std::size_t>(j)];
        goal[j] = rng.Uniform(std::max(range.lower, robot_.home[j] - 1.2),
                              std::min(range.upper, robot_.home[j] + 1.2));
      }
    }
    const Eigen::VectorXd before = operator_;
    operator_ += (goal - operator_).cwiseMax(-0.012).cwiseMin(0.012);
    operator_velocity_ = (operator_ - before) / kStep_s;
    Step();
    smallest = std::min(smallest, Clearance());
    for (int j = 0; j < robot_.chain.dof(); ++j) {
      const kinematics::JointLimits& range = robot_.chain.limits()[static_cast<std::size_t>(j)];
      ASSERT_GE(commanded_[j], range.lower - 1e-9);
      ASSERT_LE(commanded_[j], range.upper + 1e-9);
    }
  }
  EXPECT_GE(smallest, options_.clearance_m - 1e-4);
  EXPECT_LT(smallest, 0.05) << "nothing was ever near";
}

TEST_F(StepTest, ComesNoNearerToWhatWasPutBesideItButComesAway) {
  Follow();
  truth_ = Checker();
  const double before = Clearance();
  // A block that touches nothing, but lies within the clearance.
  const Eigen::Vector3d tool = robot_.chain.ToolPose(commanded_).translation;
  scene_.objects.push_back({"block",
                            geometry::Pose::FromTranslation(tool - Eigen::Vector3d(0, 0, 0.012)),
                            kinematics::Box{{0.02, 0.02, 0.02}}});
  truth_ = Checker();
  const double first = Clearance();
  ASSERT_LT(first, options_.clearance_m);
  ASSERT_LT(first, before);
  motion_->Exchange(Checker());
  operator_velocity_[1] = 0.3;
  double smallest = first;
  for (int i = 0; i < 100; ++i) {
    operator_[1] += 0.3 * kStep_s;
    Step();
    smallest = std::min(smallest, Clearance());
  }
  EXPECT_GE(smallest, first - 3e-4);
  operator_velocity_.setZero();
  operator_[1] = robot_.home[1] - 0.2;
  for (int i = 0; i < 600; ++i) Step();
  EXPECT_GT(Clearance(), options_.clearance_m);
}

TEST_F(StepTest, NeitherTakesNorStepsWithAllocation) {
  if (!test::AllocationCount::Works()) GTEST_SKIP() << "a sanitizer owns malloc";
  Follow();
  SuitIntake intake(JointMap(robot_.chain.joint_names()), robot_.chain.limits());
  intake.Begin("");
  ircp::SuitSample sample;
  sample.header.source = "suit";
  sample.names = robot_.chain.joint_names();
  sample.positions.assign(operator_.begin(), operator_.end());
  int allocated = -1;
  const auto run = [&](int steps, double velocity) {
    for (int i = 0; i < steps; ++i) {
      sample.positions[1] += velocity * kStep_s;
      sample.header.stamp = Stamp::FromNanoseconds((input_.now + FromSeconds(kStep_s)).count());
      input_.now += FromSeconds(kStep_s);
      const auto posture = intake.Take(sample, "w", input_.now);
      if (posture) motion_->Take(*posture);
      motion_->Step(input_);
    }
  };
  // Down to the table, blocked there, and up again: the second time without an allocation.
  for (int round = 0; round < 2; ++round) {
    const test::AllocationCount allocations;
    run(175, 0.8);
    run(60, 0);
    run(175, -0.8);
    run(100, 0);
    allocated = allocations.count();
  }
  EXPECT_EQ(allocated, 0);
  EXPECT_NE(motion_->phase(), Phase::kHolding);
}

}  // namespace
}  // namespace exemplar::executor
