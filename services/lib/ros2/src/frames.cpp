#include "exemplar/ros2/frames.hpp"

#include <algorithm>

#include "exemplar/ircp/check.hpp"

namespace exemplar::ros2 {

TransformMessage JointTransforms(const kinematics::RobotModel& model,
                                 const Eigen::Ref<const Eigen::VectorXd>& full, bool moving,
                                 Stamp stamp) {
  std::vector<geometry::Pose> root_T_links;
  kinematics::LinkPoses(model, full, root_T_links);
  TransformMessage message;
  for (const kinematics::Joint& joint : model.joints) {
    if ((joint.type != kinematics::JointType::kFixed) != moving) continue;
    const auto parent = static_cast<std::size_t>(joint.parent_link);
    const auto child = static_cast<std::size_t>(joint.child_link);
    message.transforms.push_back(
        {.header = {.stamp = stamp, .frame_id = model.links[parent].name},
         .child_frame_id = model.links[child].name,
         .transform = root_T_links[parent].Inverse() * root_T_links[child]});
  }
  return message;
}

Eigen::VectorXd JointsOf(const kinematics::RobotDescription& robot,
                         const ircp::JointStateSample& state) {
  Eigen::VectorXd full = kinematics::FullJointVector(robot.model, robot.chain, robot.home);
  kinematics::SetHandOpening(robot.model, state.hand_open, full);
  for (std::size_t i = 0; i < std::min(state.names.size(), state.positions.size()); ++i) {
    const int joint = robot.model.FindJoint(state.names[i]);
    if (joint >= 0) full[joint] = state.positions[i];
  }
  return full;
}

JointState ToJointState(const ircp::JointStateSample& sample) {
  return {.header = {.stamp = sample.header.stamp, .frame_id = {}},
          .name = sample.names,
          .position = sample.positions,
          .velocity = sample.velocities,
          .effort = sample.efforts};
}

JointState ToJointState(const ircp::JointCommandSample& sample) {
  return {.header = {.stamp = sample.header.stamp, .frame_id = {}},
          .name = sample.names,
          .position = sample.positions,
          .velocity = sample.velocities,
          .effort = {}};
}

JointTrajectory ToJointTrajectory(const ircp::PlanSample& sample, const std::string& base_frame) {
  JointTrajectory message{.header = {.stamp = sample.header.stamp, .frame_id = base_frame},
                          .joint_names = sample.names,
                          .points = {}};
  const std::size_t width = sample.names.size();
  for (std::size_t i = 0; i < sample.times_s.size(); ++i) {
    const auto first = sample.positions.begin() + static_cast<std::ptrdiff_t>(i * width);
    JointTrajectoryPoint& point = message.points.emplace_back();
    point.positions.assign(first, first + static_cast<std::ptrdiff_t>(width));
    point.time_from_start = FromSeconds(sample.times_s[i]);
  }
  return message;
}

Result<ircp::JointStateSample> ToSample(const JointState& message) {
  if (message.position.empty()) {
    return InvalidArgument("the joint state has no positions", "position");
  }
  ircp::JointStateSample sample;
  sample.header.source = "ros2";
  sample.header.stamp = message.header.stamp;
  sample.names = message.name;
  sample.positions = message.position;
  sample.velocities = message.velocity;
  sample.efforts = message.effort;
  if (const Status checked = ircp::Check(sample); !checked.ok()) return checked.error();
  return sample;
}

}  // namespace exemplar::ros2
