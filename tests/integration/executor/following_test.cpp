#include "executor/following.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "allocation_count.hpp"
#include "executor/following_path.hpp"
#include "executor/following_target.hpp"
#include "executor/motion_run.hpp"
#include "exemplar/base/rng.hpp"
#include "robot_rig.hpp"

namespace exemplar::executor {
namespace {

using Eigen::Vector3d;

constexpr double kRate_hz = 60;
constexpr double kNoise_m = 5e-4;

/// To and fro along y, as a cart does.
struct Cart {
  double speed_m_s = 0.2;
  double length_m = 0.4;
  Vector3d At(double t) const {
    const double way = std::fmod(speed_m_s * t, 2 * length_m);
    return {0.5, -0.2 + (way > length_m ? 2 * length_m - way : way), 0.05};
  }
};

TargetTrack Watched(const Cart& cart, double seconds, std::uint64_t seed = 1) {
  TargetTrack track;
  Rng rng(seed);
  for (int i = 0; i <= seconds * kRate_hz; ++i) {
    const double t = i / kRate_hz;
    const Vector3d noise(rng.Normal(0, kNoise_m), rng.Normal(0, kNoise_m), rng.Normal(0, kNoise_m));
    track.Add(FromSeconds(t), cart.At(t) + noise, kNoise_m);
  }
  return track;
}

TEST(TargetTrack, TellsWhereAMovingThingWillBe) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Cart cart{0.1, 0.4};
    const TargetTrack track = Watched(cart, 1.5, seed);
    EXPECT_NEAR(track.speed(), 0.1, 0.01);
    EXPECT_LT((track.PositionAt(FromSeconds(2.5)) - cart.At(2.5)).norm(), 8e-3) << seed;
    EXPECT_EQ(track.turning_points(), 0);
  }
}

TEST(TargetTrack, TakesNoiseForStandingStill) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const TargetTrack track = Watched({0, 0.4}, 3, seed);
    EXPECT_EQ(track.speed(), 0) << seed;
    EXPECT_LT((track.PositionAt(FromSeconds(10)) - Cart().At(0)).norm(), 1e-3);
    EXPECT_FALSE(track.TurnsWithin(FromSeconds(3), FromSeconds(9)));
  }
}

TEST(TargetTrack, LearnsWhereItTurns) {
  const Cart cart{0.2, 0.4};
  const TargetTrack track = Watched(cart, 5.5);  // both ends were seen: at 2 s and 4 s
  EXPECT_EQ(track.turning_points(), 2);
  for (double t = 5.5; t < 8.5; t += 0.1) {
    EXPECT_LT((track.PositionAt(FromSeconds(t)) - cart.At(t)).norm(), 0.02) << t;
  }
  EXPECT_FALSE(track.TurnsWithin(FromSeconds(5.5), FromSeconds(5.8)));
  EXPECT_TRUE(track.TurnsWithin(FromSeconds(5.8), FromSeconds(6.2)));
  EXPECT_LT(track.VelocityAt(FromSeconds(6.5)).y(), 0);
  EXPECT_GT(track.VelocityAt(FromSeconds(8.3)).y(), 0);
}

TEST(TargetTrack, ForgetsItsWayWhenItIsPutElsewhere) {
  TargetTrack track = Watched({0.2, 0.4}, 5);
  const Vector3d place(0.6, 0.3, 0.05);
  for (int i = 1; i <= 60; ++i) track.Add(FromSeconds(5 + i / kRate_hz), place, kNoise_m);
  EXPECT_EQ(track.turning_points(), 0);
  EXPECT_LT((track.PositionAt(FromSeconds(8)) - place).norm(), 2e-3);
}

TEST(TargetTrack, IgnoresWhatIsOlderThanWhatItKnows) {
  TargetTrack track = Watched({0.1, 0.4}, 1);
  const Vector3d before = track.PositionAt(FromSeconds(1));
  track.Add(FromSeconds(0.5), {9, 9, 9}, kNoise_m);
  EXPECT_EQ(track.PositionAt(FromSeconds(1)), before);
}

TEST(TargetTimes, BelongToTheTargetAroundTheTouchOnly) {
  const TargetTimes times{3, 4};
  EXPECT_EQ(times.ShareAt(0.5), 0);
  EXPECT_EQ(times.ShareAt(3), 1);
  EXPECT_EQ(times.ShareAt(4), 1);
  EXPECT_EQ(times.ShareAt(6), 0);
  for (double t = 0; t < 6; t += 0.01) {
    EXPECT_GE(times.ShareAt(t), 0);
    EXPECT_LE(times.ShareAt(t), 1);
    EXPECT_LT(std::abs(times.ShareAt(t + 0.01) - times.ShareAt(t)), 0.03) << t;
  }
}

/// A robot that is where it is told to be, and a target that moves on its own.
TEST(Following, LeadsAndLiftsOffWithoutAStepOrAnAllocation) {
  constexpr Duration kPeriod = std::chrono::milliseconds(8);
  const kinematics::RobotDescription robot = *kinematics::ReadRobotDescription(
      std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "deploy" / "models" / "arm7");
  scene::Description scene;
  scene::Button button;
  button.name = "target";
  button.base_T_object.translation = test::kTarget;
  scene.buttons.push_back(button);
  ManualClock clock;
  test::GateLog log;
  test::PressSkill skills;
  RobotView view(robot.chain.joint_names());
  TargetTracks tracks;
  PlannerOptions options;
  options.plan.touch_links = robot.touch_links;
  options.plan.comfortable = robot.home;
  options.guard.touch_n = 8;
  const Planner planner(clock, skills, robot, scene, view, options);
  const FollowingPlanner following_planner(clock, planner, tracks, robot, {});
  Rng rng(3);
  const auto see = [&] {
    ircp::JointStateSample state;
    state.names = robot.chain.joint_names();
    state.positions.assign(robot.home.data(), robot.home.data() + robot.home.size());
    state.touch_n = {0};
    view.Take(state, clock.Steady());
    geometry::Pose pose = geometry::Pose::FromTranslation(test::kTarget);
    pose.translation.y() += 0.1 * ToSeconds(clock.Steady()) + rng.Normal(0, kNoise_m);
    tracks.Add("target", clock.Steady(), pose, kNoise_m);
  };
  for (int cycle = 0; cycle < 120; ++cycle) {
    clock.Advance(kPeriod);
    see();
  }
  api::ExecuteRequest request;
  request.skill = "press";
  Result<FollowingPlan> plan = following_planner.Plan(request, std::nullopt, {});
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  ASSERT_EQ(plan->planned.zones.size(), 1U);
  const GuardZone zone = plan->planned.zones[0];
  EXPECT_LT(zone.begin_s, plan->times.contact_s);
  EXPECT_GT(zone.deepest_s, plan->times.contact_s);
  while (clock.Steady() < plan->start) {
    clock.Advance(kPeriod);
    see();
  }
  Following following(clock, log, following_planner, robot, request, *plan, plan->planned.motion);
  MotionRun run(robot, plan->planned.motion, std::move(plan->planned.checker), {}, {zone});
  run.SetFollower(&following);
  const double touched_s = 0.5 * (plan->times.contact_s + zone.deepest_s);
  int allocated = 0;
  double largest_jump = 0;
  double touch_height_m = 0;
  double after_touch_s = 0;
  double highest_m = 0;
  Eigen::VectorXd before = robot.home;
  Eigen::VectorXd speed_before = Eigen::VectorXd::Zero(robot.chain.dof());
  for (int cycle = 0; cycle < 2000 && !run.finished(); ++cycle) {
    {
      const test::AllocationCount allocations;
      (void)run.Tick(ToSeconds(kPeriod), State::kExecuting, 1);
      allocated += allocations.count();
    }
    const Eigen::VectorXd q = run.commanded();
    const Eigen::VectorXd v = (q - before) / ToSeconds(kPeriod);
    largest_jump = std::max(largest_jump, (v - speed_before).cwiseAbs().maxCoeff());
    before = q;
    speed_before = v;
    const double height_m = robot.chain.ToolPose(q).translation.z();
    if (run.path_time_s() > touched_s) {
      if (touch_height_m == 0) touch_height_m = height_m;
      after_touch_s += ToSeconds(kPeriod);
      if (after_touch_s < 0.35) highest_m = std::max(highest_m, height_m);
      MeasuredState felt;
      felt.joints = q;
      felt.touch_n = 9;
      run.Measure(felt);
    }
    clock.Advance(kPeriod);
    see();
    following.Take("target");
    if (cycle % 31 == 30) following.PlanOnce({});
  }
  EXPECT_TRUE(run.finished());
  EXPECT_FALSE(following.Problem().has_value());
  EXPECT_EQ(run.missed(), nullptr);
  EXPECT_GT(highest_m, touch_height_m + 0.004) << "it lifts off at once";
  EXPECT_LT(largest_jump, 0.15) << "rad/s from one cycle to the next";
  if (test::AllocationCount::Works()) {
    EXPECT_EQ(allocated, 0);
  }
}

}  // namespace
}  // namespace exemplar::executor
