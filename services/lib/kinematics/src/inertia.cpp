#include "exemplar/kinematics/inertia.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>

#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::kinematics {

Result<ChainInertia> ChainInertia::Create(const RobotModel& model, const Chain& chain) {
  ChainInertia out;
  out.dof_ = chain.dof();
  const Eigen::VectorXd others = FullJointVector(model, chain, Eigen::VectorXd::Zero(chain.dof()));
  const std::vector<int>& indices = chain.joint_indices();
  const auto variable_of = [&](int joint) {
    const auto found = std::find(indices.begin(), indices.end(), joint);
    return found == indices.end() ? -1 : static_cast<int>(found - indices.begin());
  };
  // Frame i is link i: its parent joint, and what the link weighs.
  for (const Link& link : model.links) {
    Frame frame;
    if (link.parent_joint >= 0) {
      const Joint& joint = model.joints[link.parent_joint];
      frame.parent = joint.parent_link;
      frame.parent_T_joint = joint.parent_T_joint;
      frame.axis = joint.axis;
      frame.moves = joint.type != JointType::kFixed;
      frame.prismatic = joint.type == JointType::kPrismatic;
      const int leader = joint.mimic ? joint.mimic->joint : link.parent_joint;
      frame.variable = frame.moves ? variable_of(leader) : -1;
      frame.multiplier = joint.mimic ? joint.mimic->multiplier : 1.0;
      frame.value = joint.mimic ? joint.mimic->offset : 0.0;
      if (frame.variable < 0) frame.value += frame.multiplier * others[leader];
    }
    if (link.inertial && link.inertial->mass_kg > 0) {
      frame.has_mass = true;
      frame.inertial = *link.inertial;
    }
    out.frames_.push_back(frame);
  }
  // A joint that moves nothing would make the matrix singular.
  std::vector<bool> carries(out.frames_.size());
  for (std::size_t i = out.frames_.size(); i-- > 0;) {
    const Frame& frame = out.frames_[i];
    carries[i] = carries[i] || frame.has_mass;
    if (carries[i] && frame.parent >= 0) carries[static_cast<std::size_t>(frame.parent)] = true;
  }
  std::vector<bool> loaded(static_cast<std::size_t>(out.dof_), false);
  for (std::size_t i = 0; i < out.frames_.size(); ++i) {
    const int variable = out.frames_[i].variable;
    if (variable >= 0 && carries[i]) loaded[static_cast<std::size_t>(variable)] = true;
  }
  for (int j = 0; j < out.dof_; ++j) {
    if (loaded[static_cast<std::size_t>(j)]) continue;
    return FailedPrecondition("robot \"" + model.name + "\" has no inertia matrix: joint \"" +
                              chain.joint_names()[static_cast<std::size_t>(j)] +
                              "\" moves no link with a mass");
  }
  return out;
}

Eigen::MatrixXd ChainInertia::MassMatrix(const Eigen::Ref<const Eigen::VectorXd>& q) const {
  assert(q.size() == dof_);
  struct Placed {
    geometry::Pose root_T_link;
    Eigen::Vector3d root_axis = Eigen::Vector3d::Zero();
  };
  std::vector<Placed> placed(frames_.size());
  Eigen::MatrixXd mass = Eigen::MatrixXd::Zero(dof_, dof_);
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, dof_);
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const Frame& frame = frames_[i];
    Placed& here = placed[i];
    if (frame.parent >= 0) {
      here.root_T_link =
          placed[static_cast<std::size_t>(frame.parent)].root_T_link * frame.parent_T_joint;
      if (frame.moves) {
        here.root_axis = here.root_T_link.rotation * frame.axis;
        const double value =
            frame.value + (frame.variable >= 0 ? frame.multiplier * q[frame.variable] : 0.0);
        if (frame.prismatic) {
          here.root_T_link.translation += value * here.root_axis;
        } else {
          here.root_T_link.rotation =
              here.root_T_link.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(value, frame.axis));
        }
      }
    }
    if (!frame.has_mass) continue;
    const geometry::Pose root_T_inertia = here.root_T_link * frame.inertial.link_T_inertia;
    jacobian.setZero();
    bool moved = false;
    for (int at = static_cast<int>(i); at >= 0; at = frames_[static_cast<std::size_t>(at)].parent) {
      const Frame& joint = frames_[static_cast<std::size_t>(at)];
      if (joint.variable < 0) continue;
      moved = true;
      const Placed& there = placed[static_cast<std::size_t>(at)];
      const Eigen::Vector3d axis = joint.multiplier * there.root_axis;
      if (joint.prismatic) {
        jacobian.col(joint.variable).head<3>() += axis;
      } else {
        jacobian.col(joint.variable).head<3>() +=
            axis.cross(root_T_inertia.translation - there.root_T_link.translation);
        jacobian.col(joint.variable).tail<3>() += axis;
      }
    }
    if (!moved) continue;
    const Eigen::Matrix3d root_R_inertia = root_T_inertia.rotation.toRotationMatrix();
    const Eigen::Matrix3d inertia =
        root_R_inertia * frame.inertial.inertia_kg_m2 * root_R_inertia.transpose();
    mass.noalias() +=
        frame.inertial.mass_kg * (jacobian.topRows<3>().transpose() * jacobian.topRows<3>());
    mass.noalias() += jacobian.bottomRows<3>().transpose() * (inertia * jacobian.bottomRows<3>());
  }
  return mass;
}

}  // namespace exemplar::kinematics
