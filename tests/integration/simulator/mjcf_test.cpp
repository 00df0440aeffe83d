#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "robots.hpp"
#include "simulator/mjcf_writer.hpp"
#include "simulator/world.hpp"

namespace exemplar::simulator {
namespace {

using ::testing::HasSubstr;

class EveryRobot : public testing::TestWithParam<std::string> {};

TEST_P(EveryRobot, StandsInTheWorldWhereItsKinematicsSayItDoes) {
  const kinematics::RobotDescription robot = Robot(GetParam());
  Result<World> world = World::Create(robot, {});
  ASSERT_TRUE(world.ok()) << world.error().message;
  Rng rng(11);
  for (int i = 0; i < 200; ++i) {
    const Eigen::VectorXd q = RandomPosture(robot.chain, rng);
    world->MoveTo(q);
    const geometry::Pose simulated = world->LinkPose(robot.chain.tip_link());
    const geometry::Pose expected = robot.chain.ToolPose(q);
    EXPECT_LT((simulated.translation - expected.translation).norm(), 1e-9);
    EXPECT_LT(geometry::AngleBetween(simulated.rotation, expected.rotation), 1e-7);
    EXPECT_LT((simulated.rotation.toRotationMatrix() - expected.rotation.toRotationMatrix()).norm(),
              1e-9);
  }
}

TEST_P(EveryRobot, HasMeasuresThatReadBackExactly) {
  const kinematics::RobotDescription robot = Robot(GetParam());
  Result<World> world = World::Create(robot, {});
  ASSERT_TRUE(world.ok()) << world.error().message;
  EXPECT_EQ(world->dof(), robot.chain.dof());
  EXPECT_EQ(world->positions(), robot.home);
}

INSTANTIATE_TEST_SUITE_P(Models, EveryRobot, testing::Values("arm7", "leonardo", "ur5e_like"),
                         [](const auto& robot) { return robot.param; });

TEST(Mjcf, NamesWithSpecialCharactersAreEscaped) {
  scene::Description scene;
  scene.obstacles.push_back({"a \"<&>\" b", {}, kinematics::Sphere{0.1}});
  scene.obstacles.back().base_T_shape.translation = {2, 2, 2};
  Result<World> world = World::Create(Robot("arm7"), scene);
  ASSERT_TRUE(world.ok()) << world.error().message;
  EXPECT_TRUE(world->Place("a \"<&>\" b", geometry::Pose::FromTranslation({3, 0, 0})).ok());
}

TEST(Mjcf, RefusesMeshesThatCannotCollide) {
  scene::Description scene;
  scene.obstacles.push_back({"rock", {}, kinematics::Mesh{"/nowhere/rock.dae"}});
  const Result<std::string> mjcf = WriteMjcf(Robot("arm7"), scene);
  ASSERT_FALSE(mjcf.ok());
  EXPECT_THAT(mjcf.error().message, HasSubstr("/nowhere/rock.dae"));
}

TEST(Mjcf, AMissingMeshIsAnErrorThatNamesIt) {
  scene::Description scene;
  scene.obstacles.push_back({"rock", {}, kinematics::Mesh{"/nowhere/rock.stl"}});
  const Result<World> world = World::Create(Robot("arm7"), scene);
  ASSERT_FALSE(world.ok());
  EXPECT_THAT(world.error().message, HasSubstr("rock.stl"));
}

TEST(Mjcf, TheButtonsSpringReachesItsClickForceAtTheClick) {
  scene::Button button;
  button.click_force_n = 5;
  button.travel_m = 0.003;
  const ButtonMechanism mechanism = MechanismOf(button);
  EXPECT_NEAR(mechanism.Force(mechanism.click_depth_m), 5, 1e-9);
  EXPECT_LT(mechanism.release_depth_m, mechanism.click_depth_m);
  EXPECT_LT(mechanism.click_depth_m, button.travel_m);
  EXPECT_GT(mechanism.preload_n, 0);
}

}  // namespace
}  // namespace exemplar::simulator
