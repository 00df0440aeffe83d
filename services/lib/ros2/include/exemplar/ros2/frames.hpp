#pragma once
// A robot and its plans as a ROS 2 graph has them. Pure functions: thread-safe.

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "exemplar/ircp/samples.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/ros2/messages.hpp"

namespace exemplar::ros2 {

/// parent_T_child over every joint that moves (`moving`), or over every fixed one, as a
/// robot_state_publisher sends them on /tf and /tf_static. `full` as kinematics::LinkPoses takes
/// it.
TransformMessage JointTransforms(const kinematics::RobotModel& model,
                                 const Eigen::Ref<const Eigen::VectorXd>& full, bool moving,
                                 Stamp stamp);

/// The model's joint vector of a measured state: joints that the state does not name are where
/// kinematics::FullJointVector puts them, its hand opens as the state says, names that the model
/// does not know are passed over.
Eigen::VectorXd JointsOf(const kinematics::RobotDescription& robot,
                         const ircp::JointStateSample& state);

JointState ToJointState(const ircp::JointStateSample& sample);
JointState ToJointState(const ircp::JointCommandSample& sample);
JointTrajectory ToJointTrajectory(const ircp::PlanSample& sample, const std::string& base_frame);

/// Errors name what a robot's state cannot be: no positions, other numbers of them than of names.
Result<ircp::JointStateSample> ToSample(const JointState& message);

}  // namespace exemplar::ros2
