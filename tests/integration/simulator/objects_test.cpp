#include <gtest/gtest.h>

#include <cmath>

#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "pressing.hpp"
#include "robots.hpp"

namespace exemplar::simulator {
namespace {

constexpr double kTableTop_m = 0.0;

void Settle(World& world, double seconds) {
  const int steps = static_cast<int>(seconds / ToSeconds(world.step()));
  for (int i = 0; i < steps; ++i) world.Step();
}

scene::Description Table(std::vector<scene::Object> objects) {
  scene::Description scene;
  scene.obstacles.push_back(
      {"table", geometry::Pose::FromTranslation({0.6, 0, -0.02}), kinematics::Box{{1, 1, 0.04}}});
  scene.objects = std::move(objects);
  return scene;
}

scene::Object Block(const Eigen::Vector3d& at = {0.5, 0, kTableTop_m + 0.025}) {
  scene::Object block;
  block.name = "block";
  block.base_T_object.translation = at;
  block.shape = kinematics::Box{{0.04, 0.04, 0.05}};
  block.mass_kg = 0.15;
  return block;
}

geometry::Pose PoseOf(const World& world, const std::string& thing) {
  return *world.ThingPose(thing);
}

/// The tool over the table, z down, the fingers to both sides along the table's y.
geometry::Pose Grip(const Eigen::Vector3d& base_p_tool) {
  Eigen::Matrix3d base_R_tool;
  base_R_tool << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return {base_p_tool, Eigen::Quaterniond(base_R_tool)};
}

class MovableObjects : public testing::Test {
 protected:
  const kinematics::RobotDescription robot_ = Robot("arm7_hand");

  Eigen::VectorXd Posture(const Eigen::Vector3d& base_p_tool, const Eigen::VectorXd& near) const {
    const auto found = kinematics::SolveIk(robot_.chain, Grip(base_p_tool), near);
    EXPECT_TRUE(found.ok()) << (found.ok() ? "" : found.error().message);
    return found.ok() ? found->q : near;
  }
  /// Straight on in small steps.
  Eigen::VectorXd Go(World& world, Eigen::VectorXd q, const Eigen::Vector3d& from,
                     const Eigen::Vector3d& to, double seconds) const {
    constexpr int kPieces = 12;
    for (int i = 1; i <= kPieces; ++i) {
      const Eigen::VectorXd next = Posture(from + (to - from) * i / kPieces, q);
      MoveAlong(world, q, next, seconds / kPieces);
      q = next;
    }
    return q;
  }
};

TEST_F(MovableObjects, StayWhereTheyAreAtRest) {
  scene::Object can{"can", geometry::Pose::FromTranslation({0.4, 0.2, 0.05}),
                    kinematics::Cylinder{0.03, 0.1}};
  scene::Object ball{"ball", geometry::Pose::FromTranslation({0.6, 0.2, 0.03}),
                     kinematics::Sphere{0.03}};
  scene::Object tray{"tray", geometry::Pose::FromTranslation({0.6, -0.3, 0.002}),
                     kinematics::Box{{0.1, 0.1, 0.004}}};
  tray.fixed = true;
  World world = MakeWorld(robot_, Table({Block(), can, ball, tray}));
  const std::vector<ThingState> before = world.things();
  Settle(world, 3);
  const std::vector<ThingState> after = world.things();
  ASSERT_EQ(after.size(), 4u);
  for (std::size_t i = 0; i < after.size(); ++i) {
    EXPECT_LT((after[i].base_T_object.translation - before[i].base_T_object.translation).norm(),
              1e-3)
        << after[i].name;
    EXPECT_LT(
        geometry::AngleBetween(after[i].base_T_object.rotation, before[i].base_T_object.rotation),
        0.02)
        << after[i].name;
  }
  EXPECT_EQ(world.faults(), 0);
}

TEST_F(MovableObjects, FallOntoTheTableWhereTheyArePut) {
  World world = MakeWorld(robot_, Table({Block()}));
  ASSERT_TRUE(world.Place("block", geometry::Pose::FromTranslation({0.7, 0.2, 0.08})).ok());
  Settle(world, 1);
  EXPECT_NEAR(PoseOf(world, "block").translation.z(), 0.025, 1e-3);
  EXPECT_NEAR(PoseOf(world, "block").translation.x(), 0.7, 2e-3);
}

TEST_F(MovableObjects, AreNotPutIntoOtherThings) {
  World world = MakeWorld(robot_, Table({Block()}));
  const Status placed = world.Place("block", geometry::Pose::FromTranslation({0.5, 0, 0.0}));
  ASSERT_FALSE(placed.ok());
  EXPECT_EQ(placed.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_NEAR(PoseOf(world, "block").translation.z(), 0.025, 1e-3) << "it stays where it was";
}

TEST_F(MovableObjects, ArePushedAsFarAsTheHandGoes) {
  World world = MakeWorld(robot_, Table({Block()}));
  world.SetHand(0);
  // The closed fingers are 18 mm thick along x, the block 40 mm: they meet at x = 0.471.
  const Eigen::Vector3d above(0.42, 0, 0.15);
  const Eigen::Vector3d before(0.42, 0, 0.03);
  const Eigen::Vector3d end(0.55, 0, 0.03);
  Eigen::VectorXd q = Posture(above, robot_.home);
  MoveAlong(world, robot_.home, q, 1);
  q = Go(world, q, above, before, 1);
  ASSERT_NEAR(PoseOf(world, "block").translation.x(), 0.5, 1e-3);
  q = Go(world, q, before, end, 2.5);
  Settle(world, 0.5);
  EXPECT_NEAR(PoseOf(world, "block").translation.x(), 0.55 + 0.009 + 0.02, 3e-3);
  EXPECT_NEAR(PoseOf(world, "block").translation.y(), 0, 3e-3);
  EXPECT_GT(world.touch_n(), -1e-9);
  EXPECT_EQ(world.faults(), 0);
}

class Hands : public MovableObjects {};

TEST_F(Hands, OpenAndCloseAsFastAsTheirJointMay) {
  World world = MakeWorld(robot_, Table({}));
  EXPECT_TRUE(world.has_hand());
  EXPECT_NEAR(world.hand_open(), 1, 1e-3);
  world.SetHand(0);
  // 40 mm at 0.15 m/s.
  Settle(world, 0.2);
  EXPECT_NEAR(world.hand_open(), 0.25, 0.1);
  Settle(world, 0.4);
  EXPECT_NEAR(world.hand_open(), 0, 0.02);
  world.SetHand(0.5);
  Settle(world, 0.6);
  EXPECT_NEAR(world.hand_open(), 0.5, 0.02);
}

TEST_F(Hands, AreOpenWhereThereIsNone) {
  World world = MakeWorld(Robot("arm7"), Table({}));
  EXPECT_FALSE(world.has_hand());
  world.SetHand(0);
  Settle(world, 0.1);
  EXPECT_EQ(world.hand_open(), 1);
}

TEST_F(Hands, CloseOnABlockLiftItAndLayItDown) {
  World world = MakeWorld(robot_, Table({Block()}));
  const Eigen::Vector3d above(0.5, 0, 0.18);
  const Eigen::Vector3d at(0.5, 0, 0.03);
  Eigen::VectorXd q = Posture(above, robot_.home);
  MoveAlong(world, robot_.home, q, 1);
  q = Go(world, q, above, at, 1);
  world.SetHand(0);
  Settle(world, 0.6);
  // 20 mm of 40 mm on each side: half open, whatever is commanded, with the hand's force a finger.
  EXPECT_NEAR(world.hand_open(), 0.5, 0.05);
  EXPECT_NEAR(world.touch_n(), 30, 10);
  q = Go(world, q, at, above, 1.5);
  Settle(world, 3);
  EXPECT_NEAR(PoseOf(world, "block").translation.z(), 0.025 + 0.15, 4e-3) << "it does not slip";
  const Eigen::Vector3d over(0.5, 0.15, 0.18);
  const Eigen::Vector3d down(0.5, 0.15, 0.033);
  q = Go(world, q, above, over, 1);
  q = Go(world, q, over, down, 1);
  world.SetHand(1);
  Settle(world, 0.6);
  q = Go(world, q, down, over, 1);
  const Eigen::Vector3d end = PoseOf(world, "block").translation;
  EXPECT_NEAR(end.x(), 0.5, 5e-3);
  EXPECT_NEAR(end.y(), 0.15, 5e-3);
  EXPECT_NEAR(end.z(), 0.025, 1e-3);
  EXPECT_EQ(world.faults(), 0);
}

TEST_F(Hands, DoNotHoldWhatIsTooHeavyForTheirFriction) {
  scene::Object block = Block();
  block.friction = 0.05;
  block.mass_kg = 0.5;  // 4.9 N against 2 x 30 N x 0.05
  World world = MakeWorld(robot_, Table({block}));
  const Eigen::Vector3d above(0.5, 0, 0.18);
  const Eigen::Vector3d at(0.5, 0, 0.03);
  Eigen::VectorXd q = Posture(above, robot_.home);
  MoveAlong(world, robot_.home, q, 1);
  q = Go(world, q, above, at, 1);
  world.SetHand(0);
  Settle(world, 0.6);
  q = Go(world, q, at, above, 1.5);
  Settle(world, 0.5);
  EXPECT_LT(PoseOf(world, "block").translation.z(), 0.05);
}

}  // namespace
}  // namespace exemplar::simulator
