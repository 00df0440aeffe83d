#include "exemplar/ros2/frames.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace exemplar::ros2 {
namespace {

kinematics::RobotDescription Robot() {
  const auto robot =
      kinematics::ReadRobotDescription(std::string(EXEMPLAR_SOURCE_DIR) + "/deploy/models/arm7");
  EXPECT_TRUE(robot.ok());
  return *robot;
}

// Chaining what /tf and /tf_static hold from the root must give the pose of the tool: ROS 2 does
// just that.
TEST(Frames, TransformsOfJointsChainToTheToolPose) {
  const kinematics::RobotDescription robot = Robot();
  ircp::JointStateSample state;
  state.names = robot.chain.joint_names();
  Eigen::VectorXd q = robot.home;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    q[i] += 0.05 * static_cast<double>(i + 1);
    state.positions.push_back(q[i]);
  }
  const Eigen::VectorXd full = JointsOf(robot, state);
  std::map<std::string, TransformStamped> parent_of;
  for (const bool moving : {true, false}) {
    for (const TransformStamped& t : JointTransforms(robot.model, full, moving, {}).transforms) {
      EXPECT_TRUE(parent_of.emplace(t.child_frame_id, t).second) << t.child_frame_id;
    }
  }
  geometry::Pose base_T_tool;
  for (std::string link = robot.chain.tip_link(); link != robot.chain.base_link();) {
    const TransformStamped& t = parent_of.at(link);
    base_T_tool = t.transform * base_T_tool;
    link = t.header.frame_id;
  }
  const geometry::Pose expected = robot.chain.ToolPose(q);
  EXPECT_LT((base_T_tool.translation - expected.translation).norm(), 1e-12);
  EXPECT_LT(base_T_tool.rotation.angularDistance(expected.rotation), 1e-7);
}

TEST(Frames, APlanBecomesATrajectoryPointByPoint) {
  ircp::PlanSample plan;
  plan.names = {"a", "b"};
  plan.times_s = {0, 0.5};
  plan.positions = {1, 2, 3, 4};
  const JointTrajectory trajectory = ToJointTrajectory(plan, "base");
  EXPECT_EQ(trajectory.joint_names, plan.names);
  ASSERT_EQ(trajectory.points.size(), 2u);
  EXPECT_EQ(trajectory.points[1].positions, (std::vector<double>{3, 4}));
  EXPECT_EQ(trajectory.points[1].time_from_start, std::chrono::milliseconds(500));
  EXPECT_EQ(trajectory.header.frame_id, "base");
}

TEST(Frames, AStateOfRos2ThatNoRobotCanHaveIsRefusedByName) {
  JointState state;
  state.name = {"a", "b"};
  EXPECT_NE(ToSample(state).error().message.find("no positions"), std::string::npos);
  state.position = {1};
  EXPECT_NE(ToSample(state).error().message.find("1 values for 2 names"), std::string::npos);
  state.position = {1, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_NE(ToSample(state).error().message.find("\"b\""), std::string::npos);
  state.position = {1, 2};
  ASSERT_TRUE(ToSample(state).ok());
  EXPECT_EQ(ToSample(state)->header.source, "ros2");
}

}  // namespace
}  // namespace exemplar::ros2
