#include "simulator/world.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "pressing.hpp"
#include "robots.hpp"
#include "simulator/mjcf_writer.hpp"

namespace exemplar::simulator {
namespace {

using ::testing::HasSubstr;

constexpr double kGravity = 9.81;

void Settle(World& world, double seconds) {
  const int steps = static_cast<int>(seconds / ToSeconds(world.step()));
  for (int i = 0; i < steps; ++i) world.Step();
}

class EveryRobotWorld : public testing::TestWithParam<std::string> {};

TEST_P(EveryRobotWorld, HoldsItsPostureAgainstGravity) {
  const kinematics::RobotDescription robot = Robot(GetParam());
  World world = MakeWorld(robot, {});
  Rng rng(5);
  for (int posture = 0; posture < 5; ++posture) {
    Eigen::VectorXd q = robot.home;
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const kinematics::JointLimits& limits = robot.chain.limits()[static_cast<std::size_t>(i)];
      q[i] = std::clamp(q[i] + rng.Uniform(-0.2, 0.2), limits.lower, limits.upper);
    }
    world.MoveTo(q);
    Settle(world, 1);
    EXPECT_LT((world.positions() - q).cwiseAbs().maxCoeff(), 1e-3) << "posture " << posture;
    for (std::size_t i = 0; i < robot.chain.limits().size(); ++i) {
      EXPECT_LE(std::abs(world.efforts()[static_cast<Eigen::Index>(i)]),
                robot.chain.limits()[i].effort);
    }
  }
  EXPECT_EQ(world.faults(), 0);
}

TEST_P(EveryRobotWorld, TracksUsualMotionsWithinThirtyMilliradians) {
  const kinematics::RobotDescription robot = Robot(GetParam());
  World world = MakeWorld(robot, {});
  Rng rng(6);
  Eigen::VectorXd from = robot.home;
  double worst = 0;
  double fastest = 0;
  int free_motions = 0;
  for (int motion = 0; motion < 12; ++motion) {
    Eigen::VectorXd to = robot.home;
    for (Eigen::Index i = 0; i < to.size(); ++i) {
      const kinematics::JointLimits& limits = robot.chain.limits()[static_cast<std::size_t>(i)];
      to[i] = std::clamp(to[i] + rng.Uniform(-0.4, 0.4), limits.lower + 0.02, limits.upper - 0.02);
    }
    bool touched_itself = false;
    double error = 0;
    MoveAlong(world, from, to, 0.7, [&](const Eigen::VectorXd& target) {
      touched_itself = touched_itself || world.deepest_contact_m() > 0;
      error = std::max(error, (world.positions() - target).cwiseAbs().maxCoeff());
      fastest = std::max(fastest, world.velocities().cwiseAbs().maxCoeff());
    });
    if (!touched_itself) {
      ++free_motions;
      worst = std::max(worst, error);
    }
    world.MoveTo(to);
    from = to;
  }
  EXPECT_LT(worst, 0.03);
  EXPECT_GE(free_motions, 6);
  EXPECT_GT(fastest, 0.8) << "the motions were to be of a usual speed";
  EXPECT_EQ(world.faults(), 0);
}

INSTANTIATE_TEST_SUITE_P(Models, EveryRobotWorld, testing::Values("arm7", "leonardo", "ur5e_like"),
                         [](const auto& robot) { return robot.param; });

/// Leonardo at the table.
class Pressing : public testing::Test {
 protected:
  const kinematics::RobotDescription robot_ = Robot("leonardo");
  const scene::Description scene_ = Scene("press_table.yaml");
  const scene::Button& button_ = scene_.buttons[0];
  World world_ = MakeWorld(robot_, scene_);

  ButtonState state() const { return world_.buttons()[0]; }
  Press Reach(double depth_m) {
    Press press(robot_, button_, button_.base_T_object, depth_m);
    MoveAlong(world_, robot_.home, press.above, 1);
    return press;
  }
};

TEST_F(Pressing, TheButtonClicksOncePerPress) {
  const Press press = Reach(0.007);
  for (std::uint64_t i = 1; i <= 3; ++i) {
    press.GoDown(world_);
    Settle(world_, 0.2);
    EXPECT_EQ(state().clicks, i);
    EXPECT_GT(world_.touch_n(), button_.click_force_n);
    press.GoUp(world_);
    Settle(world_, 0.2);
    EXPECT_EQ(world_.touch_n(), 0);
    EXPECT_LT(state().depth_m, 1e-4) << "the cap comes back";
  }
  EXPECT_EQ(world_.faults(), 0);
}

TEST_F(Pressing, ALightTouchDoesNotClick) {
  const Press press = Reach(0.001);
  press.GoDown(world_);
  Settle(world_, 0.2);
  EXPECT_GT(world_.touch_n(), 0.3);
  EXPECT_LT(world_.touch_n(), button_.click_force_n);
  EXPECT_EQ(state().clicks, 0u);
}

TEST_F(Pressing, TouchEqualsTheSpringAndStaysQuiet) {
  const Press press = Reach(0.003);
  press.GoDown(world_);
  Settle(world_, 0.3);
  const ButtonMechanism mechanism = MechanismOf(button_);
  double least = 1e9;
  double most = 0;
  for (int i = 0; i < 500; ++i) {
    world_.Step();
    least = std::min(least, world_.touch_n());
    most = std::max(most, world_.touch_n());
  }
  ASSERT_GT(state().depth_m, 5e-4) << "the spring carries the finger, not the stop";
  ASSERT_LT(state().depth_m, button_.travel_m - 5e-4);
  // The cap's own weight helps the finger.
  EXPECT_NEAR(world_.touch_n() + mechanism.cap_mass_kg * kGravity, state().spring_n,
              0.01 * state().spring_n);
  EXPECT_LT(most - least, 0.02 * most);
}

TEST_F(Pressing, AButtonHalfReleasedDoesNotClickAgain) {
  const Press deep = Reach(0.0065);
  deep.GoDown(world_);
  Settle(world_, 0.1);
  ASSERT_EQ(state().clicks, 1u);
  // Up to a depth between release and click, and down again.
  const ButtonMechanism mechanism = MechanismOf(button_);
  const double middle = 0.5 * (mechanism.release_depth_m + mechanism.click_depth_m);
  const Eigen::VectorXd half =
      PostureFor(robot_.chain, ToolOver(button_, button_.base_T_object, -middle), deep.down.back());
  MoveAlong(world_, deep.down.back(), half, 0.3);
  Settle(world_, 0.1);
  ASSERT_LT(state().depth_m, mechanism.click_depth_m);
  ASSERT_GT(state().depth_m, mechanism.release_depth_m);
  MoveAlong(world_, half, deep.down.back(), 0.3);
  Settle(world_, 0.1);
  EXPECT_EQ(state().clicks, 1u);
}

TEST_F(Pressing, ClicksAreTimedAndCanBeForgotten) {
  const Press press = Reach(0.007);
  const Duration before = world_.time();
  press.GoDown(world_);
  EXPECT_GT(state().last_click, before);
  EXPECT_LE(state().last_click, world_.time());
  world_.ResetClicks();
  EXPECT_EQ(state().clicks, 0u);
}

TEST_F(Pressing, AMovedAndTurnedButtonClicksWhereItIsNow) {
  const geometry::Pose place{{0.40, -0.28, 0.06}, geometry::ExpSo3({0.0, -0.1, 0.6})};
  ASSERT_TRUE(world_.Place("target", place).ok());
  const Press press(robot_, button_, place, 0.007);
  MoveAlong(world_, robot_.home, press.above, 1);
  press.GoDown(world_);
  Settle(world_, 0.1);
  EXPECT_EQ(state().clicks, 1u);
  EXPECT_LT((state().base_T_object.translation - place.translation).norm(), 1e-12);
}

TEST_F(Pressing, NothingIsPlacedInTheRobot) {
  geometry::Pose in_the_finger =
      geometry::Pose::FromTranslation(robot_.chain.ToolPose(robot_.home).translation);
  const Status placed = world_.Place("target", in_the_finger);
  ASSERT_FALSE(placed.ok());
  EXPECT_EQ(placed.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_THAT(placed.error().message, HasSubstr("stand in the robot"));
  EXPECT_EQ(state().base_T_object.translation, button_.base_T_object.translation);
  EXPECT_EQ(world_.touch_n(), 0);
}

TEST_F(Pressing, AButtonOnARailGoesToAndFroAndBeginsWhereItIsPlaced) {
  scene::Description scene = Scene("press_table.yaml");
  scene.buttons.front().rail =
      scene::Rail{.base_direction = Eigen::Vector3d::UnitY(), .length_m = 0.03, .speed_m_s = 0.1};
  World world = MakeWorld(robot_, scene);
  const auto way = [&](const Eigen::Vector3d& from) {
    return Eigen::Vector3d(world.ThingPose("target")->translation - from);
  };
  const auto run = [&](int steps) {
    for (int i = 0; i < steps; ++i) world.Step();
  };
  const Eigen::Vector3d start = scene.buttons.front().base_T_object.translation;
  run(201);
  EXPECT_NEAR((way(start) - Eigen::Vector3d(0, 0.02, 0)).norm(), 0, 1e-9);
  run(200);
  EXPECT_NEAR((way(start) - Eigen::Vector3d(0, 0.02, 0)).norm(), 0, 1e-9);
  const Eigen::Vector3d elsewhere = start + Eigen::Vector3d(0.02, -0.05, 0.01);
  ASSERT_TRUE(world.Place("target", geometry::Pose::FromTranslation(elsewhere)).ok());
  run(101);
  EXPECT_NEAR((way(elsewhere) - Eigen::Vector3d(0, 0.01, 0)).norm(), 0, 1e-9);
}

TEST_F(Pressing, AnUnknownThingCannotBePlaced) {
  const Status placed = world_.Place("lamp", {});
  ASSERT_FALSE(placed.ok());
  EXPECT_EQ(placed.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(placed.error().message, HasSubstr("\"lamp\""));
}

TEST_F(Pressing, TheTableStopsTheHand) {
  const Eigen::Vector3d start = robot_.chain.ToolPose(robot_.home).translation;
  geometry::Pose below = geometry::Pose::FromTranslation({start.x(), start.y(), -0.02});
  below.rotation = Eigen::Quaterniond(0, 1, 0, 0);
  const Eigen::VectorXd q = PostureFor(robot_.chain, below, robot_.home);
  MoveAlong(world_, robot_.home, q, 1);
  Settle(world_, 0.5);
  EXPECT_GT(world_.LinkPose("tool").translation.z(), -0.003);
  EXPECT_GT(world_.touch_n(), 1);
  EXPECT_EQ(world_.faults(), 0);
}

TEST(World, TheSameCommandsGiveTheSameResult) {
  const kinematics::RobotDescription robot = Robot("leonardo");
  const scene::Description scene = Scene("press_table.yaml");
  const auto run = [&] {
    World world = MakeWorld(robot, scene);
    const Press press(robot, scene.buttons[0], scene.buttons[0].base_T_object, 0.007);
    std::vector<double> trace;
    const auto keep = [&](const Eigen::VectorXd&) {
      const Eigen::VectorXd q = world.positions();
      trace.insert(trace.end(), q.data(), q.data() + q.size());
      trace.push_back(world.touch_n());
      trace.push_back(world.buttons()[0].depth_m);
    };
    MoveAlong(world, robot.home, press.above, 0.5, keep);
    MoveAlong(world, press.above, press.down.back(), 0.5, keep);
    return trace;
  };
  const std::vector<double> first = run();
  EXPECT_EQ(first, run());
  EXPECT_GT(first.back(), 0.001) << "the button was pressed";
}

TEST(World, RefusesAStepThatPhysicsCannotTake) {
  const Result<World> world =
      World::Create(Robot("arm7"), {}, {.step = std::chrono::milliseconds(50)});
  ASSERT_FALSE(world.ok());
  EXPECT_EQ(world.error().field, "step");
}

}  // namespace
}  // namespace exemplar::simulator
