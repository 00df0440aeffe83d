#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "gateway/foxglove/scene_feed.hpp"

namespace exemplar::gateway::foxglove {
namespace {

constexpr const char* kModels = EXEMPLAR_SOURCE_DIR "/deploy/models";

kinematics::RobotDescription Robot(const std::string& name) {
  auto robot = kinematics::ReadRobotDescription(std::filesystem::path(kModels) / name);
  EXPECT_TRUE(robot.ok());
  return std::move(*robot);
}

TEST(SceneTransforms, PutTheToolWhereTheChainHasIt) {
  const kinematics::RobotDescription robot = Robot("arm7");
  ircp::JointStateSample state;
  state.names = robot.chain.joint_names();
  Eigen::VectorXd joints = robot.home;
  for (int i = 0; i < joints.size(); ++i) joints[i] += 0.1 * (i % 3 - 1);
  state.positions.assign(joints.data(), joints.data() + joints.size());
  std::map<std::string, FrameTransform> to_parent;
  for (const FrameTransform& transform : TransformsAt(robot, state, {})) {
    EXPECT_TRUE(to_parent.emplace(transform.child, transform).second);
  }
  geometry::Pose tool;
  for (std::string link = robot.chain.tip_link(); link != robot.chain.base_link();
       link = to_parent.at(link).parent) {
    tool = to_parent.at(link).parent_T_child * tool;
  }
  const geometry::Pose wanted = robot.chain.ToolPose(joints);
  EXPECT_LT((tool.translation - wanted.translation).norm(), 1e-12);
  EXPECT_LT(geometry::AngleBetween(tool.rotation, wanted.rotation), 1e-6);
}

TEST(SceneTransforms, StandAtHomeBeforeAStateCame) {
  const kinematics::RobotDescription robot = Robot("arm7");
  EXPECT_EQ(TransformsAt(robot, {}, {}).size(), robot.model.joints.size());
}

TEST(SceneOfARobot, HasEveryLinkWithAShapeInTheLinksFrame) {
  for (const char* name : {"arm7", "arm7_hand", "leonardo", "ur5e_like"}) {
    const kinematics::RobotDescription robot = Robot(name);
    std::vector<std::string> notices;
    const SceneUpdate update = DrawRobot(robot, {}, notices);
    EXPECT_TRUE(notices.empty()) << name << ": " << notices.front();
    std::size_t shapes = 0;
    for (const kinematics::Link& link : robot.model.links) shapes += link.collisions.size();
    std::size_t drawn = 0;
    for (const Entity& entity : update.entities) {
      EXPECT_GE(robot.model.FindLink(entity.frame), 0);
      drawn += entity.cubes.size() + entity.cylinders.size() + entity.spheres.size() +
               entity.models.size();
    }
    EXPECT_EQ(drawn, shapes) << name;
  }
}

TEST(SceneOfARobot, LeavesAMeshOutThatIsNotThereAndSaysSo) {
  kinematics::RobotDescription robot = Robot("arm7");
  robot.model.links.back().collisions = {{{}, kinematics::Mesh{"/nowhere/hand.stl"}}};
  std::vector<std::string> notices;
  DrawRobot(robot, {}, notices);
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_NE(notices.front().find("/nowhere/hand.stl"), std::string::npos);
}

TEST(SceneOfARobot, DrawsACapsuleAsACylinderBetweenTwoSpheres) {
  kinematics::RobotDescription robot = Robot("arm7");
  for (kinematics::Link& link : robot.model.links) link.collisions.clear();
  robot.model.links[1].collisions = {{{}, kinematics::Capsule{0.05, 0.4}}};
  std::vector<std::string> notices;
  const SceneUpdate update = DrawRobot(robot, {}, notices);
  ASSERT_EQ(update.entities.size(), 1U);
  EXPECT_EQ(update.entities[0].cylinders.at(0).size, Eigen::Vector3d(0.1, 0.1, 0.4));
  ASSERT_EQ(update.entities[0].spheres.size(), 2U);
  EXPECT_EQ(update.entities[0].spheres[0].pose.translation, Eigen::Vector3d(0, 0, -0.2));
}

TEST(SceneOfAPlan, IsTheToolsWayAndGoesWithAnEmptyPlan) {
  ircp::PlanSample plan;
  plan.skill = "press";
  plan.tool_m = {0, 0, 0, 1, 2, 3, 4, 5, 6};
  const SceneUpdate update = DrawPlan(plan, "base", {});
  ASSERT_EQ(update.entities.size(), 1U);
  ASSERT_EQ(update.entities[0].lines.at(0).points.size(), 3U);
  EXPECT_EQ(update.entities[0].lines[0].points[1], Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(update.entities[0].labels.at(0).text, "press");
  plan.tool_m.clear();
  EXPECT_EQ(DrawPlan(plan, "base", {}).deletions, std::vector<std::string>{"plan"});
}

TEST(SceneOfAnObject, IsACubeWithItsName) {
  ircp::ObjectSample object;
  object.name = "target";
  object.base_T_object.translation = {1, 2, 3};
  const Entity entity = DrawObject(object, "base", {});
  EXPECT_EQ(entity.frame, "base");
  EXPECT_EQ(entity.cubes.at(0).pose.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(entity.labels.at(0).text, "target");
}

/// Independent readers are in tests/system/foxglove_test.py.
TEST(SceneBytes, HoldStringsNumbersAndCountsAsCdrHasThem) {
  const std::vector<FrameTransform> transforms = {
      {Stamp::FromNanoseconds(1'000'000'002), "a", "bc", {}}};
  std::string wanted("\0\1\0\0\1\0\0\0\1\0\0\0\2\0\0\0\2\0\0\0a\0", 22);
  wanted += std::string("\0\0\3\0\0\0bc\0", 9);
  wanted += std::string(1, '\0');  // to a multiple of eight behind the header
  wanted += std::string(48, '\0');
  wanted += std::string("\0\0\0\0\0\0\xf0\x3f", 8);
  const std::string bytes = Encode(transforms);
  EXPECT_EQ(bytes.size() % 8, 4U);
  EXPECT_EQ(bytes.substr(0, 31), wanted.substr(0, 31));
  EXPECT_EQ(bytes.substr(bytes.size() - 8), wanted.substr(wanted.size() - 8));
}

}  // namespace
}  // namespace exemplar::gateway::foxglove
