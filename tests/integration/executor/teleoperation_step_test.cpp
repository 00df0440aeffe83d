// What a teleoperated robot does at each step, and what it never does.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "allocation_count.hpp"
#include "executor/teleoperation_motion.hpp"
#include "executor/teleoperation_suit.hpp"
#include "exemplar/base/rng.hpp"

namespace exemplar::executor {
namespace {

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

TEST_F(StepTest, APressWaitsForWhereTheOperatorStandsNow) {
  options_.suit_patience = std::chrono::seconds(2);
  motion_ = Make();
  motion_->Begin(robot_.home, 0);
  operator_[0] += 1.5;
  Steps(3);
  suit_speaks_ = false;  // another suit takes over; the last sample would still do
  Press();
  Steps(40);
  EXPECT_TRUE(motion_->changes().empty()) << "not refused for the posture of a suit that is gone";
  operator_[0] -= 1.4;
  suit_speaks_ = true;
  Steps(1);
  EXPECT_EQ(motion_->phase(), Phase::kApproaching);
}

TEST_F(StepTest, APressWithoutAnOperatorIsRefusedForThat) {
  options_.suit_patience = std::chrono::seconds(2);
  motion_ = Make();
  motion_->Begin(robot_.home, 0);
  Steps(3);
  suit_speaks_ = false;
  Press();
  Steps(70);
  EXPECT_EQ(motion_->phase(), Phase::kHolding);
  EXPECT_EQ(last_change_.reason, HoldReason::kSuitSilent);
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
