// The control loop's cycle: along the path, at rest where it must be, without allocation.

#include "executor/motion_run.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "allocation_count.hpp"
#include "executor/lateness.hpp"
#include "executor/path_player.hpp"
#include "exemplar/base/rng.hpp"
#include "timing.hpp"

namespace exemplar::executor {
namespace {

constexpr double kPeriod_s = 0.008;

kinematics::RobotDescription Arm() {
  return *kinematics::ReadRobotDescription(std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "deploy" /
                                           "models" / "arm7");
}

/// The first joint swings to and fro.
motion::PlannedMotion Swing(const kinematics::RobotDescription& robot, double duration_s) {
  motion::PlannedMotion plan;
  const int frames = 101;
  plan.trajectory.joint_names = robot.chain.joint_names();
  plan.trajectory.positions = robot.home.transpose().replicate(frames, 1);
  plan.trajectory.velocities = Eigen::MatrixXd::Zero(frames, robot.chain.dof());
  const double omega = 2 * M_PI / duration_s;
  for (int k = 0; k < frames; ++k) {
    const double t = duration_s * k / (frames - 1);
    plan.trajectory.time_s.push_back(t);
    plan.trajectory.positions(k, 0) += 0.2 * (1 - std::cos(omega * t));
    plan.trajectory.velocities(k, 0) = 0.2 * omega * std::sin(omega * t);
  }
  return plan;
}

collision::CollisionChecker Checker(const kinematics::RobotDescription& robot) {
  return *collision::CollisionChecker::Create(robot.model, {});
}

TEST(PathPlayer, StaysOnThePathAtAnySpeed) {
  const kinematics::RobotDescription robot = Arm();
  const motion::PlannedMotion plan = Swing(robot, 3);
  PathPlayer player(plan.trajectory, robot.chain.limits());
  Rng rng(1);
  Eigen::VectorXd position(robot.chain.dof());
  Eigen::VectorXd velocity(robot.chain.dof());
  Eigen::VectorXd on_path(robot.chain.dof());
  Eigen::VectorXd unused(robot.chain.dof());
  double before_s = 0;
  for (int cycle = 0; cycle < 3000; ++cycle) {
    player.Advance(kPeriod_s, rng.Uniform(), 3);
    player.Evaluate(position, velocity);
    motion::Evaluate(plan.trajectory, player.time_s(), on_path, unused);
    EXPECT_EQ(position, on_path);
    EXPECT_GE(player.time_s(), before_s);
    EXPECT_LE(player.time_s(), before_s + kPeriod_s + 1e-12);
    before_s = player.time_s();
  }
}

TEST(PathPlayer, CommandsTheVelocityThatItMoves) {
  const kinematics::RobotDescription robot = Arm();
  const motion::PlannedMotion plan = Swing(robot, 4);
  PathPlayer player(plan.trajectory, robot.chain.limits());
  Eigen::VectorXd position(robot.chain.dof());
  Eigen::VectorXd velocity(robot.chain.dof());
  player.Advance(1.0, 0.5, 1e6);
  player.Evaluate(position, velocity);
  const double before = position[0];
  const double commanded = velocity[0];
  player.Advance(1e-5, 0.5, 1e6);
  player.Evaluate(position, velocity);
  EXPECT_NEAR((position[0] - before) / 1e-5, commanded, 1e-4);
}

TEST(PathPlayer, RampsAlikeAtAnyPeriod) {
  const kinematics::RobotDescription robot = Arm();
  const motion::PlannedMotion plan = Swing(robot, 4);
  PathPlayer fine(plan.trajectory, robot.chain.limits());
  PathPlayer coarse(plan.trajectory, robot.chain.limits());
  for (int i = 0; i < 1000; ++i) fine.Advance(1e-3, 1, 2);
  coarse.Advance(1.0, 1, 2);
  // Half a second of ramp makes a quarter of a second of path.
  EXPECT_NEAR(coarse.time_s(), 0.75, 1e-12);
  EXPECT_NEAR(fine.time_s(), 0.75, 1e-9);
}

/// A plan at its limits: the home posture, a random one, a third one and back.
motion::JointTrajectory Hurry(const kinematics::RobotDescription& robot, Rng& rng) {
  std::vector<double> time_s;
  Eigen::MatrixXd path(120, robot.chain.dof());
  const Eigen::VectorXd speed =
      Eigen::VectorXd::NullaryExpr(robot.chain.dof(), [&] { return rng.Uniform(0.5, 6); });
  for (int k = 0; k < 120; ++k) {
    time_s.push_back(k / 60.0);
    for (int j = 0; j < robot.chain.dof(); ++j) {
      path(k, j) = robot.home[j] + 0.5 * std::sin(speed[j] * time_s.back());
    }
  }
  std::vector<double> frame_time_s;
  return motion::TimePath(time_s, path, robot.chain.joint_names(), robot.chain.limits(), 1,
                          frame_time_s);
}

TEST(PathPlayer, BreaksNoLimitHoweverSpeedAndPausesChange) {
  const kinematics::RobotDescription robot = Arm();
  const std::vector<kinematics::JointLimits>& limits = robot.chain.limits();
  constexpr double kStep_s = 0.001;
  Rng rng(2);
  int rests = 0;
  for (int run = 0; run < 60; ++run) {
    const motion::JointTrajectory plan = Hurry(robot, rng);
    PathPlayer player(plan, limits);
    Eigen::MatrixXd velocities(robot.chain.dof(), 3);
    velocities.setZero();
    Eigen::VectorXd position(robot.chain.dof());
    Eigen::VectorXd velocity(robot.chain.dof());
    double target = 1;
    int broken_until = 0;
    for (int cycle = 0; cycle < 20000 && !player.at_end(); ++cycle) {
      if (rng.Uniform() < 0.004) {
        const double choice = rng.Uniform();
        target = choice < 0.4 ? 0 : choice < 0.7 ? 1 : rng.Uniform(0.1, 1);
      }
      player.Advance(kStep_s, target, 1 / (target == 0 ? kStopRamp_s : kPauseRamp_s));
      player.Evaluate(position, velocity);
      if (player.at_end()) break;
      rests += player.rate() == 0;
      // Differences look back two steps.
      if (!player.keeps_limits()) broken_until = cycle + 3;
      velocities.leftCols<2>() = velocities.rightCols<2>().eval();
      velocities.col(2) = velocity;
      for (Eigen::Index j = 0; j < velocity.size(); ++j) {
        const kinematics::JointLimits& limit = limits[static_cast<std::size_t>(j)];
        const double before = (velocities(j, 1) - velocities(j, 0)) / kStep_s;
        const double now = (velocities(j, 2) - velocities(j, 1)) / kStep_s;
        ASSERT_LE(std::abs(velocity[j]), limit.velocity) << run << " " << cycle;
        if (cycle < broken_until) continue;
        ASSERT_LE(std::abs(now), limit.acceleration) << run << " " << cycle;
        ASSERT_LE(std::abs(now - before) / kStep_s, limit.jerk) << run << " " << cycle;
      }
    }
  }
  EXPECT_GT(rests, 1000);
}

TEST(PathPlayer, AStopBeginsAtOnceAndEndsInHalfASecond) {
  const kinematics::RobotDescription robot = Arm();
  constexpr double kStep_s = 0.001;
  Rng rng(3);
  for (int run = 0; run < 100; ++run) {
    const motion::JointTrajectory plan = Hurry(robot, rng);
    PathPlayer player(plan, robot.chain.limits());
    const int cycles = 200 + static_cast<int>(rng.Below(1500));
    for (int cycle = 0; cycle < cycles; ++cycle) player.Advance(kStep_s, 1, 1 / kPauseRamp_s);
    for (int cycle = 0; cycle < 501; ++cycle) player.Advance(kStep_s, 0, 1 / kStopRamp_s);
    EXPECT_TRUE(player.rate() == 0 || player.at_end()) << run;
  }
}

class MotionRunTest : public ::testing::Test {
 protected:
  MotionRunTest() : robot_(Arm()), run_(robot_, Swing(robot_, 2), Checker(robot_), {}) {}

  void Run(double seconds, State state, double speed = 1) {
    for (double t = 0; t < seconds - 1e-9; t += kPeriod_s) run_.Tick(kPeriod_s, state, speed);
  }

  kinematics::RobotDescription robot_;
  MotionRun run_;
};

TEST_F(MotionRunTest, DoesNotAllocateInItsCycle) {
  run_.Tick(kPeriod_s, State::kExecuting, 1);
  if (!test::AllocationCount::Works()) GTEST_SKIP() << "a sanitizer owns malloc";
  const test::AllocationCount allocations;
  for (int i = 0; i < 100; ++i) run_.Tick(kPeriod_s, State::kExecuting, 1);
  for (int i = 0; i < 100; ++i) run_.Tick(kPeriod_s, State::kPaused, 1);
  for (int i = 0; i < 100; ++i) run_.AddLateness(std::chrono::microseconds(i));
  EXPECT_EQ(allocations.count(), 0);
}

TEST(GuardedRun, GoesOverToTheWayOutWithoutAStepOrAnAllocation) {
  const kinematics::RobotDescription robot = Arm();
  GuardZone zone{"target", 5, 0.01, 0.5, 2.0, {}};
  for (double t = 0.5; t <= 2.0; t += kGuardStep_s) zone.leave_s.push_back(4 - t);
  MotionRun run(robot, Swing(robot, 4), Checker(robot), {}, {zone});
  double before = robot.home[0];
  double speed_before = 0;
  double deepest = 0;
  double largest_change = 0;
  int allocated = 0;
  int cycles = 0;
  for (; cycles < 1000 && !run.finished(); ++cycles) {
    if (cycles == 140) {
      deepest = before;
      MeasuredState felt;
      felt.joints = run.commanded();
      felt.touch_n = 6;
      run.Measure(felt);
    }
    const test::AllocationCount allocations;
    const Setpoint& setpoint = run.Tick(kPeriod_s, State::kExecuting, 1);
    allocated += allocations.count();
    const double speed = (setpoint.positions[0] - before) / kPeriod_s;
    largest_change = std::max(largest_change, std::abs(speed - speed_before));
    before = setpoint.positions[0];
    speed_before = speed;
    if (deepest > 0) {
      EXPECT_LT(before, deepest + 0.03);
    }
  }
  EXPECT_TRUE(run.finished());
  EXPECT_EQ(run.missed(), nullptr);
  EXPECT_NEAR(before, robot.home[0], 1e-9);
  // Unpressed it takes 4 s and the rest at the end.
  EXPECT_LT(cycles * kPeriod_s, 3.2);
  EXPECT_LT(largest_change, 0.12) << "rad/s from one cycle to the next";
  if (test::AllocationCount::Works()) {
    EXPECT_EQ(allocated, 0);
  }
}

TEST(GuardedRun, KnowsThePressThatMetNoTouch) {
  const kinematics::RobotDescription robot = Arm();
  const GuardZone zone{"target", 5, 0.01, 0.5, 1.0, {3.0}};
  MotionRun run(robot, Swing(robot, 2), Checker(robot), {}, {zone});
  for (int cycle = 0; cycle < 1000 && !run.finished(); ++cycle) {
    EXPECT_EQ(run.missed() != nullptr, run.path_time_s() >= 1.0);
    run.Tick(kPeriod_s, State::kExecuting, 1);
  }
  ASSERT_NE(run.missed(), nullptr);
  EXPECT_EQ(run.missed()->object, "target");
}

TEST(AllocationCount, SeesWhatEigenAndTheStandardLibraryAllocate) {
  if (!test::AllocationCount::Works()) GTEST_SKIP() << "a sanitizer owns malloc";
  const test::AllocationCount allocations;
  const Eigen::VectorXd some = Eigen::VectorXd::Zero(20);
  const volatile double* seen = some.data();  // or the compiler leaves the allocation out
  EXPECT_EQ(seen[3], 0);
  const int after_eigen = allocations.count();
  EXPECT_GE(after_eigen, 1);
  const std::vector<int> more(50, 1);
  const volatile int* looked_at = more.data();
  EXPECT_EQ(looked_at[3], 1);
  EXPECT_GT(allocations.count(), after_eigen);
}

TEST_F(MotionRunTest, FinishesAtTheEndOfThePathAndHoldsThere) {
  Run(2.0 + kPauseRamp_s, State::kExecuting);
  EXPECT_FALSE(run_.finished());
  Run(kSettle_s + 0.1, State::kExecuting);
  EXPECT_TRUE(run_.finished());
  EXPECT_LT((run_.commanded() - robot_.home).norm(), 1e-9);
}

TEST_F(MotionRunTest, RestsOnThePathWhilePausedAndGoesOn) {
  Run(1.0, State::kExecuting);
  Run(kPauseRamp_s + kPeriod_s, State::kPaused);
  const double rested_s = run_.path_time_s();
  Run(5.0, State::kPaused);
  EXPECT_EQ(run_.path_time_s(), rested_s);
  EXPECT_FALSE(run_.finished());
  Run(0.5, State::kExecuting);
  EXPECT_GT(run_.path_time_s(), rested_s + 0.2);
}

TEST_F(MotionRunTest, ComesToRestWithinTheStatedTimeAfterAFault) {
  for (const State stopped : {State::kProtectiveStop, State::kEmergencyStop, State::kAborted}) {
    // Slow enough that the joints' limits allow the shortest ramp.
    MotionRun run(robot_, Swing(robot_, 4), Checker(robot_), {});
    for (double t = 0; t < 0.8; t += kPeriod_s) run.Tick(kPeriod_s, State::kExecuting, 1);
    const double fault_s = run.path_time_s();
    for (double t = 0; t < kStopRamp_s; t += kPeriod_s) run.Tick(kPeriod_s, stopped, 1);
    const double rest_s = run.path_time_s();
    EXPECT_LE(rest_s - fault_s, 0.5 * kStopRamp_s + kPeriod_s);
    const Setpoint& held = run.Tick(kPeriod_s, stopped, 1);
    EXPECT_EQ(held.velocities[0], 0);
    EXPECT_EQ(run.path_time_s(), rest_s);
    for (double t = 0; t < kSettle_s; t += kPeriod_s) run.Tick(kPeriod_s, stopped, 1);
    EXPECT_TRUE(run.finished()) << ToString(stopped);
  }
}

TEST_F(MotionRunTest, ReportsTheLargestTrackingErrorOfWhatWasMeasured) {
  run_.Tick(kPeriod_s, State::kExecuting, 1);
  MeasuredState state;
  state.joints = robot_.home;
  state.joints[2] += 0.03;
  run_.Measure(state);
  state.joints[2] -= 0.02;
  state.touch_n = 4;
  run_.Measure(state);
  EXPECT_TRUE(run_.has_unwatched());
  EXPECT_FALSE(run_.Watch().has_value());
  EXPECT_FALSE(run_.has_unwatched());
  api::ExecutionResult result;
  run_.Report(result);
  EXPECT_NEAR(result.tracking_error_rad, 0.03, 1e-3);
  EXPECT_EQ(result.touch_max_n, 4);
  ASSERT_TRUE(result.touch_onset_s.has_value());
  EXPECT_EQ(result.base_T_tool.size(), result.tool_time_s.size());
}

TEST_F(MotionRunTest, NamesTheJointThatDoesNotFollow) {
  run_.Tick(kPeriod_s, State::kExecuting, 1);
  MeasuredState state;
  state.joints = robot_.home;
  state.joints[4] += 0.5;
  run_.Measure(state);
  const std::optional<std::string> wrong = run_.Watch();
  ASSERT_TRUE(wrong.has_value());
  EXPECT_NE(wrong->find("joint5"), std::string::npos) << *wrong;
}

TEST_F(MotionRunTest, SaysWhenTheTouchIsTooStrong) {
  run_.Tick(kPeriod_s, State::kExecuting, 1);
  run_.Measure({robot_.home, 200, Duration(0)});
  const std::optional<std::string> wrong = run_.Watch();
  ASSERT_TRUE(wrong.has_value());
  EXPECT_NE(wrong->find("200.0 N"), std::string::npos) << *wrong;
}

/// A post stands 20 mm beside the tool, where the first joint's turning takes it.
TEST(Monitor, SlowsDownOnlyWhileBodiesApproach) {
  const kinematics::RobotDescription robot = Arm();
  const motion::PlannedMotion plan = Swing(robot, 2);
  Eigen::VectorXd turned = robot.home;
  turned[0] += 0.01;
  const Eigen::Vector3d tip = robot.chain.ToolPose(robot.home).translation;
  const Eigen::Vector3d way = robot.chain.ToolPose(turned).translation - tip;
  const Eigen::VectorXd home = kinematics::FullJointVector(robot.model, robot.chain, robot.home);
  std::optional<collision::CollisionChecker> checker;
  for (double ahead_m = 0.03; !checker && ahead_m < 0.3; ahead_m += 0.001) {
    collision::Scene scene;
    scene.objects.push_back({"post",
                             geometry::Pose::FromTranslation(tip + ahead_m * way.normalized()),
                             kinematics::Sphere{0.01}});
    checker = *collision::CollisionChecker::Create(robot.model, std::move(scene));
    if (checker->SmallestClearance(home).distance_m < 0.02) checker.reset();
  }
  ASSERT_TRUE(checker.has_value());

  Monitor monitor(robot, plan, *std::move(checker), {});
  Measurement now;
  now.commanded = robot.home;
  now.state.received = std::chrono::seconds(1);
  const auto move = [&](double tool_m_s) {
    now.commanded[0] += 0.01 * tool_m_s * kPeriod_s / way.norm();
    now.state.joints = now.commanded;
    now.state.received += FromSeconds(kPeriod_s);
    now.elapsed_s += kPeriod_s;
    const std::optional<std::string> wrong = monitor.Observe(now);
    EXPECT_FALSE(wrong.has_value()) << *wrong;
    return monitor.speed_share();
  };
  for (int state = 0; state < 10; ++state) EXPECT_EQ(move(1e-7), 1) << "near, and at rest";
  double share = 1;
  for (int state = 0; state < 12; ++state) share = move(0.12);
  EXPECT_LT(share, 0.6);
  EXPECT_GE(share, 0.1);
  for (int state = 0; state < 10; ++state) share = move(-0.12);
  EXPECT_EQ(share, 1) << "still near, but parting";
}

TEST(Lateness, QuantilesAreWithinABinOfTheTruth) {
  LatenessHistogram histogram;
  for (int i = 1; i <= 1000; ++i) histogram.Add(std::chrono::microseconds(i));
  EXPECT_NEAR(histogram.QuantileSeconds(0.99), 990e-6, 0.1 * 990e-6);
  EXPECT_NEAR(histogram.QuantileSeconds(0.5), 500e-6, 0.1 * 500e-6);
  EXPECT_DOUBLE_EQ(histogram.max_s(), 1e-3);
  EXPECT_EQ(histogram.count(), 1000U);
}

}  // namespace
}  // namespace exemplar::executor
