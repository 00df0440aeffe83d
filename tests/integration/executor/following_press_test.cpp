// A moving button pressed, against the simulator's physics.

#include <gtest/gtest.h>

#include "executor/following.hpp"
#include "executor/motion_run.hpp"
#include "executor/planner.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/rng.hpp"
#include "robot_rig.hpp"
#include "simulator/world.hpp"

namespace exemplar::executor {
namespace {

using test::kTarget;

constexpr Duration kPeriod = std::chrono::milliseconds(8);
constexpr double kNoise_m = 5e-4;

struct Outcome {
  bool planned = false;
  std::string refusal;
  std::uint64_t clicks = 0;
  int plans = 0;
  std::optional<std::string> problem;
  double largest_speed = 0;         ///< of a joint, of its limit
  double largest_acceleration = 0;  ///< likewise, between commands
  double largest_jump_rad = 0;      ///< of a command off where the one before it was going
  double touch_max_n = 0;
  std::optional<std::string> missed;  ///< the target that was not felt
  double longest_touch_s = 0;
};

struct Situation {
  double watch_s = 0;         ///< the cart runs for so long before anybody plans
  double blind_from_s = 1e9;  ///< nobody sees it from here of the motion on
  double lower_m = 0;         ///< the button is by so much lower than it is seen
  double guard_touch_n = 0;
};

class FollowingPress : public ::testing::Test {
 protected:
  FollowingPress()
      : robot_(*kinematics::ReadRobotDescription(std::filesystem::path(EXEMPLAR_SOURCE_DIR) /
                                                 "deploy" / "models" / "arm7")) {
    scene_.obstacles.push_back({"table", geometry::Pose::FromTranslation({0.5, 0, -0.05}),
                                kinematics::Box{{1.4, 1.4, 0.03}}});
    scene::Button button;
    button.name = "target";
    button.base_T_object.translation = kTarget;
    button.travel_m = 0.003;
    scene_.buttons.push_back(button);
    request_.skill = "press";
    request_.follow = true;
    options_.plan.touch_links = robot_.touch_links;
    options_.plan.comfortable = robot_.home;
  }

  Outcome Press(double speed_m_s, double length_m, const Situation& situation) {
    options_.guard.touch_n = situation.guard_touch_n;
    scene::Description real = scene_;
    real.buttons[0].base_T_object.translation.z() -= situation.lower_m;
    real.buttons[0].rail = scene::Rail{
        .base_direction = Eigen::Vector3d::UnitY(), .length_m = length_m, .speed_m_s = speed_m_s};
    Result<simulator::World> world = simulator::World::Create(robot_, real);
    EXPECT_TRUE(world.ok());
    ManualClock clock;
    test::GateLog log;
    test::PressSkill skills;
    RobotView view(robot_.chain.joint_names());
    TargetTracks tracks;
    Rng rng(7);
    const Planner planner(clock, skills, robot_, scene_, view, options_);
    const FollowingPlanner following_planner(clock, planner, tracks, robot_, {});
    int cycles = 0;
    bool blind = false;
    const auto see = [&] {
      ircp::JointStateSample state;
      state.names = robot_.chain.joint_names();
      const Eigen::VectorXd q = world->positions();
      state.positions.assign(q.data(), q.data() + q.size());
      state.touch_n = {world->touch_n()};
      view.Take(state, clock.Steady());
      if (++cycles % 2 != 0 || blind) return false;
      geometry::Pose pose = *world->ThingPose("target");
      pose.translation.z() += situation.lower_m;
      for (int i = 0; i < 3; ++i) pose.translation[i] += rng.Normal(0, kNoise_m);
      tracks.Add("target", clock.Steady(), pose, kNoise_m);
      return true;
    };
    const auto advance = [&] {
      for (int step = 0; step < 8; ++step) world->Step();
      clock.Advance(kPeriod);
    };
    for (double t = 0; t < situation.watch_s; t += ToSeconds(kPeriod)) {
      advance();
      (void)see();
    }

    Outcome outcome;
    Result<FollowingPlan> plan = following_planner.Plan(request_, std::nullopt, {});
    outcome.planned = plan.ok();
    if (!plan.ok()) {
      outcome.refusal = plan.error().message;
      return outcome;
    }
    while (clock.Steady() < plan->start) {
      advance();
      (void)see();
    }
    Following following(clock, log, following_planner, robot_, request_, *plan,
                        plan->planned.motion);
    EXPECT_EQ(plan->planned.zones.size(), situation.guard_touch_n > 0 ? 1U : 0U);
    MotionRun run(robot_, plan->planned.motion, std::move(plan->planned.checker), {},
                  plan->planned.zones);
    run.SetFollower(&following);
    double touch_s = 0;
    Eigen::VectorXd before = robot_.home;
    Eigen::VectorXd speed_before = Eigen::VectorXd::Zero(robot_.chain.dof());
    for (int cycle = 0; cycle < 4000 && !run.finished(); ++cycle) {
      const Setpoint& setpoint = run.Tick(ToSeconds(kPeriod), State::kExecuting, 1);
      const auto n = robot_.chain.dof();
      const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(setpoint.positions.data(), n);
      const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(setpoint.velocities.data(), n);
      for (int j = 0; j < n; ++j) {
        const kinematics::JointLimits& limits = robot_.chain.limits()[static_cast<std::size_t>(j)];
        const double period = ToSeconds(kPeriod);
        outcome.largest_speed =
            std::max(outcome.largest_speed, std::abs(q[j] - before[j]) / period / limits.velocity);
        outcome.largest_acceleration =
            std::max(outcome.largest_acceleration,
                     std::abs(v[j] - speed_before[j]) / period / limits.acceleration);
        outcome.largest_jump_rad =
            std::max(outcome.largest_jump_rad,
                     std::abs(q[j] - before[j] - 0.5 * period * (v[j] + speed_before[j])));
      }
      before = q;
      speed_before = v;
      world->SetTarget(q, v);
      advance();
      MeasuredState measured;
      measured.joints = world->positions();
      measured.touch_n = world->touch_n();
      run.Measure(measured);
      outcome.touch_max_n = std::max(outcome.touch_max_n, measured.touch_n);
      touch_s = measured.touch_n > 0 ? touch_s + ToSeconds(kPeriod) : 0;
      outcome.longest_touch_s = std::max(outcome.longest_touch_s, touch_s);
      blind = run.path_time_s() > situation.blind_from_s;
      if (see()) following.Take("target");
      if (cycle % 31 == 30) following.PlanOnce({});
      if (!outcome.problem) outcome.problem = following.Problem();
    }
    EXPECT_TRUE(run.finished());
    outcome.clicks = world->buttons()[0].clicks;
    if (run.missed() != nullptr) outcome.missed = run.missed()->object;
    outcome.plans = following.plans_blended();
    EXPECT_EQ(world->faults(), 0);
    return outcome;
  }

  kinematics::RobotDescription robot_;
  scene::Description scene_;
  PlannerOptions options_;
  api::ExecuteRequest request_;
};

TEST_F(FollowingPress, ClicksAButtonThatStands) {
  const Outcome outcome = Press(0, 0.4, {.watch_s = 1});
  ASSERT_TRUE(outcome.planned) << outcome.refusal;
  EXPECT_EQ(outcome.clicks, 1U);
  EXPECT_FALSE(outcome.problem.has_value()) << *outcome.problem;
}

TEST_F(FollowingPress, ClicksAButtonOnACart) {
  for (const double speed_m_s : {0.05, 0.1, 0.2}) {
    for (const double more_s : {0.5, 1.3, 2.4}) {
      // There and back, so that both ends of its way are known.
      const double watch_s = 2 * 0.4 / speed_m_s + more_s;
      SCOPED_TRACE(std::to_string(speed_m_s) + " m/s, watched for " + std::to_string(watch_s));
      const Outcome outcome = Press(speed_m_s, 0.4, {.watch_s = watch_s});
      ASSERT_TRUE(outcome.planned) << outcome.refusal;
      EXPECT_EQ(outcome.clicks, 1U);
      EXPECT_FALSE(outcome.problem.has_value()) << *outcome.problem;
      EXPECT_LT(outcome.largest_speed, 1.02);
      EXPECT_LT(outcome.largest_acceleration, 1.1);
      EXPECT_LT(outcome.largest_jump_rad, 1e-3) << "changes of plan are smooth";
    }
  }
}

constexpr double kTouch_n = 8;

TEST_F(FollowingPress, EndsByTouchWhereverTheButtonIsWithinTheGuard) {
  for (const double speed_m_s : {0.0, 0.1}) {  // what is faster is pressed by position
    for (const double lower_m : {-0.004, 0.0, 0.006}) {
      SCOPED_TRACE(std::to_string(speed_m_s) + " m/s, " + std::to_string(lower_m) + " m lower");
      const double watch_s = speed_m_s > 0 ? 2 * 0.4 / speed_m_s + 0.7 : 1;
      const Outcome outcome = Press(
          speed_m_s, 0.4, {.watch_s = watch_s, .lower_m = lower_m, .guard_touch_n = kTouch_n});
      ASSERT_TRUE(outcome.planned) << outcome.refusal;
      EXPECT_EQ(outcome.clicks, 1U);
      EXPECT_FALSE(outcome.problem.has_value()) << *outcome.problem;
      EXPECT_FALSE(outcome.missed.has_value());
      EXPECT_GE(outcome.touch_max_n, kTouch_n);
      EXPECT_LT(outcome.touch_max_n, 2.5 * kTouch_n);
      EXPECT_LT(outcome.longest_touch_s, 0.6) << "it lifts off on the touch";
      EXPECT_LT(outcome.largest_speed, 1.02);
      EXPECT_LT(outcome.largest_acceleration, 1.1);
      EXPECT_LT(outcome.largest_jump_rad, 1e-3);
    }
  }
}

TEST_F(FollowingPress, SaysWhatWasNotMetWithinTheGuard) {
  const Outcome outcome =
      Press(0.1, 0.4, {.watch_s = 8.7, .lower_m = 0.018, .guard_touch_n = kTouch_n});
  ASSERT_TRUE(outcome.planned) << outcome.refusal;
  EXPECT_EQ(outcome.clicks, 0U);
  EXPECT_EQ(outcome.missed, "target");
  EXPECT_FALSE(outcome.problem.has_value()) << *outcome.problem;
}

TEST_F(FollowingPress, NeedsNoTurnToFollow) {
  const Outcome outcome = Press(0.1, 0.8, {.watch_s = 1});
  ASSERT_TRUE(outcome.planned) << outcome.refusal;
  EXPECT_EQ(outcome.clicks, 1U);
}

TEST_F(FollowingPress, SaysSoWhereTheTargetTurnsAsNeverBefore) {
  const Outcome outcome =
      Press(0.1, 0.3, {.watch_s = 1.5});  // it turns after 3 s, the contact was to be later
  ASSERT_TRUE(outcome.planned) << outcome.refusal;
  EXPECT_TRUE(outcome.clicks == 1 || outcome.problem.has_value()) << "it is not missed quietly";
}

TEST_F(FollowingPress, SaysThatTheTargetIsLost) {
  const Outcome outcome = Press(0.1, 0.4, {.watch_s = 1, .blind_from_s = 0.5});
  ASSERT_TRUE(outcome.planned) << outcome.refusal;
  ASSERT_TRUE(outcome.problem.has_value());
  EXPECT_NE(outcome.problem->find("\"target\" is lost"), std::string::npos) << *outcome.problem;
}

TEST_F(FollowingPress, RefusesWhatIsNotSeenOrTooFast) {
  const Outcome unseen = Press(0.1, 0.4, {});
  EXPECT_FALSE(unseen.planned);
  EXPECT_FALSE(unseen.refusal.empty());
  const Outcome fast = Press(0.3, 0.6, {.watch_s = 1});
  EXPECT_FALSE(fast.planned);
  EXPECT_NE(fast.refusal.find("at most 0.250"), std::string::npos) << fast.refusal;
}

}  // namespace
}  // namespace exemplar::executor
