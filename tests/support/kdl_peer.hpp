#pragma once
// The same chain by KDL's own means, as an independent peer.

#include <algorithm>
#include <kdl/chain.hpp>
#include <optional>
#include <vector>

#include "exemplar/kinematics/chain.hpp"

namespace exemplar::testing {

inline KDL::Frame ToKdl(const geometry::Pose& pose) {
  const Eigen::Vector3d& p = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  return {KDL::Rotation::Quaternion(q.x(), q.y(), q.z(), q.w()), KDL::Vector(p.x(), p.y(), p.z())};
}

/// Nothing for chains that KDL has no counterpart for: with mimic joints, or not from a link down
/// to one below it.
inline std::optional<KDL::Chain> ToKdl(const kinematics::RobotModel& model,
                                       const kinematics::Chain& chain) {
  std::vector<int> path;
  for (int link = model.FindLink(chain.tip_link()); link != model.FindLink(chain.base_link());
       link = model.joints[path.back()].parent_link) {
    if (model.links[link].parent_joint < 0) return std::nullopt;
    path.push_back(model.links[link].parent_joint);
  }
  KDL::Chain result;
  for (auto j = path.rbegin(); j != path.rend(); ++j) {
    const kinematics::Joint& joint = model.joints[*j];
    if (joint.mimic) return std::nullopt;
    const KDL::Frame frame = ToKdl(joint.parent_T_joint);
    const KDL::Vector axis = frame.M * KDL::Vector(joint.axis.x(), joint.axis.y(), joint.axis.z());
    const KDL::Joint::JointType type = joint.type == kinematics::JointType::kPrismatic
                                           ? KDL::Joint::TransAxis
                                           : KDL::Joint::RotAxis;
    result.addSegment(joint.type == kinematics::JointType::kFixed
                          ? KDL::Segment(KDL::Joint(KDL::Joint::Fixed), frame)
                          : KDL::Segment(KDL::Joint(joint.name, frame.p, axis, type), frame));
  }
  return result;
}

}  // namespace exemplar::testing
