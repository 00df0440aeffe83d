// Presses that end by touch, against the simulator's physics.

#include <gtest/gtest.h>

#include "executor/motion_run.hpp"
#include "executor/planner.hpp"
#include "exemplar/base/clock.hpp"
#include "robot_rig.hpp"
#include "simulator/world.hpp"

namespace exemplar::executor {
namespace {

using test::kTarget;

constexpr double kPeriod_s = 0.008;

struct Outcome {
  bool finished = false;
  std::uint64_t clicks = 0;
  double touch_max_n = 0;
  std::optional<std::string> missed;
  std::optional<std::string> wrong;
  double end_height_m = 0;  ///< of the tool over where the target is expected
  double largest_step_rad = 0;
  Eigen::VectorXd commanded = {};
};

class GuardedPress : public ::testing::Test {
 protected:
  GuardedPress()
      : robot_(*kinematics::ReadRobotDescription(std::filesystem::path(EXEMPLAR_SOURCE_DIR) /
                                                 "deploy" / "models" / "arm7")) {
    scene_.obstacles.push_back({"table", geometry::Pose::FromTranslation({0.5, 0, -0.05}),
                                kinematics::Box{{1.4, 1.4, 0.03}}});
    scene::Button button;
    button.name = "target";
    button.base_T_object.translation = kTarget;
    scene_.buttons.push_back(button);
  }

  /// Of the target at kTarget, from where the robot was told to be.
  Result<Planned> Plan(const Eigen::VectorXd& start, double guard_touch_n) {
    ManualClock clock;
    test::PressSkill skills;
    RobotView view(robot_.chain.joint_names());
    PlannerOptions options;
    options.plan.touch_links = robot_.touch_links;
    options.plan.comfortable = robot_.home;
    options.guard.touch_n = guard_touch_n;
    ircp::JointStateSample state;
    state.names = robot_.chain.joint_names();
    state.positions.assign(start.data(), start.data() + start.size());
    state.touch_n = {0};
    view.Take(state, clock.Steady());
    const Planner planner(clock, skills, robot_, scene_, view, options);
    api::ExecuteRequest request;
    request.skill = "press";
    request.objects = {{"target", geometry::Pose::FromTranslation(kTarget), true}};
    return planner.Plan(request, std::nullopt, {});
  }

  /// One period of the control loop, of the physics and of the watch.
  void Cycle(MotionRun& run, simulator::World& world, State state, Outcome& outcome) const {
    const Setpoint& setpoint = run.Tick(kPeriod_s, state, 1);
    const auto n = robot_.chain.dof();
    const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(setpoint.positions.data(), n);
    world.SetTarget(q, Eigen::Map<const Eigen::VectorXd>(setpoint.velocities.data(), n));
    if (outcome.commanded.size() > 0) {
      outcome.largest_step_rad =
          std::max(outcome.largest_step_rad, (q - outcome.commanded).cwiseAbs().maxCoeff());
    }
    outcome.commanded = q;
    for (int step = 0; step < 8; ++step) {
      world.Step();
      outcome.touch_max_n = std::max(outcome.touch_max_n, world.touch_n());
    }
    MeasuredState measured;
    measured.joints = world.positions();
    measured.touch_n = world.touch_n();
    measured.received = world.time();
    measured.stamp = Stamp::FromNanoseconds(world.time().count());
    measured.feels_touch = true;
    run.Measure(measured);
    const std::optional<std::string> wrong = run.Watch();
    if (wrong && !outcome.wrong) outcome.wrong = wrong;
  }

  /// The target is expected at kTarget, and stands `lower_m` lower than that.
  Outcome Press(double lower_m, double guard_touch_n) {
    Result<Planned> planned = Plan(robot_.home, guard_touch_n);
    EXPECT_TRUE(planned.ok()) << planned.error().message;
    if (!planned.ok()) return {};
    EXPECT_EQ(planned->zones.size(), guard_touch_n > 0 ? 1U : 0U);

    scene::Description real = scene_;
    real.buttons[0].base_T_object.translation.z() -= lower_m;
    Result<simulator::World> world = simulator::World::Create(robot_, real);
    EXPECT_TRUE(world.ok());
    WatchLimits limits;
    limits.clearance_m = -0.02;  // the target is not where the watch takes it to be
    MotionRun run(robot_, std::move(planned->motion), std::move(planned->checker), limits,
                  std::move(planned->zones));
    Outcome outcome;
    for (int cycle = 0; cycle < 4000 && !run.finished(); ++cycle) {
      Cycle(run, *world, State::kExecuting, outcome);
    }
    outcome.finished = run.finished();
    outcome.clicks = world->buttons()[0].clicks;
    if (run.missed() != nullptr) outcome.missed = run.missed()->object;
    outcome.end_height_m = robot_.chain.ToolPose(world->positions()).translation.z() - kTarget.z();
    return outcome;
  }

  kinematics::RobotDescription robot_;
  scene::Description scene_;
};

constexpr double kTouch_n = 8;

TEST_F(GuardedPress, EndsByTouchWhereverTheButtonIsWithinTheGuard) {
  for (const double lower_m : {-0.006, -0.003, 0.0, 0.002, 0.004}) {
    SCOPED_TRACE(lower_m);
    const Outcome outcome = Press(lower_m, kTouch_n);
    EXPECT_TRUE(outcome.finished);
    EXPECT_FALSE(outcome.wrong.has_value()) << *outcome.wrong;
    EXPECT_FALSE(outcome.missed.has_value());
    EXPECT_EQ(outcome.clicks, 1U);
    EXPECT_GE(outcome.touch_max_n, kTouch_n);
    EXPECT_LT(outcome.touch_max_n, 2 * kTouch_n);
    EXPECT_GT(outcome.end_height_m, 0.06) << "lifted off";
    EXPECT_LT(outcome.largest_step_rad, 0.02) << "the way over to the way out is smooth";
  }
}

TEST_F(GuardedPress, IsStrongerByPositionAlone) {
  const Outcome by_position = Press(-0.006, 0);
  const Outcome by_touch = Press(-0.006, kTouch_n);
  EXPECT_GT(by_position.touch_max_n, 2 * by_touch.touch_max_n);
}

TEST_F(GuardedPress, SaysWhatWasNotMetWithinTheGuard) {
  const Outcome outcome = Press(0.015, kTouch_n);
  EXPECT_TRUE(outcome.finished);
  EXPECT_EQ(outcome.missed, "target");
  EXPECT_EQ(outcome.clicks, 0U);
  EXPECT_EQ(outcome.touch_max_n, 0);
  EXPECT_GT(outcome.end_height_m, 0.06);
}

TEST_F(GuardedPress, BacksOffAndPressesAgainAfterAStopInTheTouch) {
  for (const double guard_touch_n : {0.0, kTouch_n}) {
    SCOPED_TRACE(guard_touch_n);
    Result<simulator::World> world = simulator::World::Create(robot_, scene_);
    ASSERT_TRUE(world.ok());
    Result<Planned> first = Plan(robot_.home, guard_touch_n);
    ASSERT_TRUE(first.ok()) << first.error().message;
    Outcome stopped;
    MotionRun run(robot_, std::move(first->motion), std::move(first->checker), {},
                  std::move(first->zones));
    for (int cycle = 0; cycle < 4000 && !run.finished(); ++cycle) {
      const bool stop = stopped.touch_max_n > 2;
      Cycle(run, *world, stop ? State::kProtectiveStop : State::kExecuting, stopped);
    }
    ASSERT_FALSE(stopped.wrong) << *stopped.wrong;
    ASSERT_GT(world->touch_n(), 1) << "it still presses";
    const double touch_n = world->touch_n();
    const std::uint64_t clicks = world->buttons()[0].clicks;

    Result<Planned> second = Plan(stopped.commanded, guard_touch_n);
    ASSERT_TRUE(second.ok()) << second.error().message;
    ASSERT_FALSE(second->warnings.empty());
    EXPECT_NE(second->warnings[0].find("in touch with \"target\""), std::string::npos)
        << second->warnings[0];
    const double away_s = second->motion.touches.at(0).end_s;
    Outcome again;
    MotionRun next(robot_, std::move(second->motion), std::move(second->checker), {},
                   std::move(second->zones));
    for (int cycle = 0; cycle < 4000 && !next.finished(); ++cycle) {
      Cycle(next, *world, State::kExecuting, again);
      if (next.path_time_s() < away_s) {
        EXPECT_LT(again.touch_max_n, touch_n + 0.5);
      }
    }
    EXPECT_TRUE(next.finished());
    EXPECT_FALSE(again.wrong) << *again.wrong;
    EXPECT_EQ(next.missed(), nullptr);
    EXPECT_EQ(world->buttons()[0].clicks, clicks + 1);
    EXPECT_EQ(world->touch_n(), 0);
  }
}

}  // namespace
}  // namespace exemplar::executor
