#include "exemplar/kinematics/chain.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "exemplar/base/text.hpp"

namespace exemplar::kinematics {
namespace {

Result<int> FindLinkOrSay(const RobotModel& model, std::string_view name, std::string_view field) {
  const int found = model.FindLink(name);
  if (found >= 0) return found;
  std::vector<std::string> names;
  for (const Link& link : model.links) names.push_back(link.name);
  const std::optional<std::string> near = NearestName(name, names);
  return NotFound("robot \"" + model.name + "\" has no link \"" + std::string(name) + "\"" +
                      (near ? "; did you mean \"" + *near + "\"?" : ""),
                  std::string(field));
}

Result<int> DefaultTip(const RobotModel& model) {
  if (const int tool = model.FindLink("tool"); tool >= 0) return tool;
  std::vector<bool> is_parent(model.links.size(), false);
  for (const Joint& joint : model.joints) is_parent[joint.parent_link] = true;
  if (std::count(is_parent.begin(), is_parent.end(), false) != 1) {
    return InvalidArgument(
        "robot \"" + model.name + "\" has no link \"tool\" and several leaves: name the tip",
        "tip");
  }
  return static_cast<int>(std::find(is_parent.begin(), is_parent.end(), false) - is_parent.begin());
}

/// Joints from the root down to `link`.
std::vector<int> PathFromRoot(const RobotModel& model, int link) {
  std::vector<int> path;
  while (model.links[link].parent_joint >= 0) {
    path.push_back(model.links[link].parent_joint);
    link = model.joints[path.back()].parent_link;
  }
  std::reverse(path.begin(), path.end());
  return path;
}

}  // namespace

/// Collects joints along the way and gives every one the shape that the loops below want: its axis
/// is z, and the fixed transforms around it are folded into the neighbours'.
class Chain::Builder {
 public:
  explicit Builder(const RobotModel& model) : model_(model) {}

  void Down(const Joint& joint) {
    pending_ = pending_ * joint.parent_T_joint.ToIsometry();
    Turn(joint, 1.0);
  }
  void Up(const Joint& joint) {
    Turn(joint, -1.0);
    pending_ = pending_ * joint.parent_T_joint.Inverse().ToIsometry();
  }

  Result<Chain> Finish(int base, int tip) {
    chain_.base_link_ = model_.links[base].name;
    chain_.tip_link_ = model_.links[tip].name;
    if (chain_.steps_.empty()) {
      return InvalidArgument("no movable joint lies between links \"" + chain_.base_link_ +
                             "\" and \"" + chain_.tip_link_ + "\"");
    }
    for (std::size_t i = 0; i < chain_.limits_.size(); ++i) {
      if (chain_.limits_[i].lower > chain_.limits_[i].upper) {
        return InvalidArgument("joint \"" + chain_.names_[i] +
                               "\": its limits and those of the joints that mimic it exclude each "
                               "other");
      }
    }
    chain_.last_R_tip_ = pending_.linear();
    chain_.last_p_tip_ = pending_.translation();
    return std::move(chain_);
  }

 private:
  void Turn(const Joint& joint, double direction) {
    if (joint.type == JointType::kFixed) return;
    const int leader = joint.mimic ? joint.mimic->joint : model_.FindJoint(joint.name);
    Step step;
    step.variable = Variable(leader);
    step.prismatic = joint.type == JointType::kPrismatic;
    const double multiplier = joint.mimic ? joint.mimic->multiplier : 1.0;
    const double offset = joint.mimic ? joint.mimic->offset : 0.0;
    step.multiplier = direction * multiplier;
    step.offset = direction * offset;
    if (joint.mimic) Narrow(joint, step.variable, multiplier, offset);

    const Eigen::Matrix3d joint_R_z =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), joint.axis).toRotationMatrix();
    step.before_R_z = pending_.linear() * joint_R_z;
    step.before_p = pending_.translation();
    pending_ = Eigen::Isometry3d::Identity();
    pending_.linear() = joint_R_z.transpose();
    chain_.plain_ = chain_.plain_ && !joint.mimic && !step.prismatic && direction > 0;
    chain_.steps_.push_back(step);
  }

  int Variable(int joint) {
    const auto found = std::find(chain_.joint_indices_.begin(), chain_.joint_indices_.end(), joint);
    const int index = static_cast<int>(found - chain_.joint_indices_.begin());
    if (found == chain_.joint_indices_.end()) {
      chain_.joint_indices_.push_back(joint);
      chain_.names_.push_back(model_.joints[joint].name);
      chain_.limits_.push_back(model_.joints[joint].limits);
    }
    return index;
  }

  /// A joint that mimics must stay within limits of its own.
  void Narrow(const Joint& joint, int variable, double multiplier, double offset) {
    if (multiplier == 0) return;
    const double a = (joint.limits.lower - offset) / multiplier;
    const double b = (joint.limits.upper - offset) / multiplier;
    JointLimits& limits = chain_.limits_[variable];
    limits.lower = std::max(limits.lower, std::min(a, b));
    limits.upper = std::min(limits.upper, std::max(a, b));
    limits.velocity = std::min(limits.velocity, joint.limits.velocity / std::abs(multiplier));
  }

  const RobotModel& model_;
  Chain chain_;
  Eigen::Isometry3d pending_ = Eigen::Isometry3d::Identity();
};

Result<Chain> Chain::Create(const RobotModel& model, std::string_view base, std::string_view tip) {
  assert(!model.links.empty());
  Result<int> first = base.empty() ? Result<int>(0) : FindLinkOrSay(model, base, "base");
  if (!first) return first.error();
  Result<int> last = tip.empty() ? DefaultTip(model) : FindLinkOrSay(model, tip, "tip");
  if (!last) return last.error();

  const std::vector<int> to_base = PathFromRoot(model, *first);
  const std::vector<int> to_tip = PathFromRoot(model, *last);
  std::size_t shared = 0;
  while (shared < to_base.size() && shared < to_tip.size() && to_base[shared] == to_tip[shared]) {
    ++shared;
  }
  Builder builder(model);
  for (std::size_t i = to_base.size(); i > shared; --i) builder.Up(model.joints[to_base[i - 1]]);
  for (std::size_t i = shared; i < to_tip.size(); ++i) builder.Down(model.joints[to_tip[i]]);
  return builder.Finish(*first, *last);
}

/// Runs along the chain and hands each joint's axis and origin, in the base frame, to `visit`.
template <class Visit>
geometry::Pose Chain::Walk(const Eigen::Ref<const Eigen::VectorXd>& q, Visit&& visit) const {
  assert(q.size() == dof());
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  for (const Step& step : steps_) {
    const double value = step.multiplier * q[step.variable] + step.offset;
    position.noalias() += rotation * step.before_p;
    const Eigen::Matrix3d turned = rotation * step.before_R_z;
    if (step.prismatic) {
      rotation = turned;
      position += value * turned.col(2);
    } else {
      const double c = std::cos(value);
      const double s = std::sin(value);
      rotation.col(0) = c * turned.col(0) + s * turned.col(1);
      rotation.col(1) = c * turned.col(1) - s * turned.col(0);
      rotation.col(2) = turned.col(2);
    }
    visit(step, turned.col(2), position);
  }
  position.noalias() += rotation * last_p_tip_;
  const Eigen::Matrix3d tip = rotation * last_R_tip_;
  return {position, Eigen::Quaterniond(tip).normalized()};
}

geometry::Pose Chain::ToolPose(const Eigen::Ref<const Eigen::VectorXd>& q) const {
  return Walk(q, [](const Step&, const auto&, const Eigen::Vector3d&) {});
}

geometry::Pose Chain::ToolPoseAndJacobian(
    const Eigen::Ref<const Eigen::VectorXd>& q,
    Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> jacobian) const {
  assert(jacobian.cols() == dof());
  // One joint a column: the joint's origin waits in the upper half until the tip is known.
  if (plain_) {
    int column = 0;
    const geometry::Pose base_T_tip =
        Walk(q, [&](const Step&, const auto& axis, const Eigen::Vector3d& origin) {
          jacobian.col(column).head<3>() = origin;
          jacobian.col(column).tail<3>() = axis;
          ++column;
        });
    for (int i = 0; i < column; ++i) {
      const Eigen::Vector3d axis = jacobian.col(i).tail<3>();
      const Eigen::Vector3d arm = base_T_tip.translation - jacobian.col(i).head<3>();
      jacobian.col(i).head<3>() = axis.cross(arm);
    }
    return base_T_tip;
  }
  // Several joints may share a column. For a rotation axis a through p the tip's velocity is
  // a x tip - a x p, so that only the sums of a and a x p are kept.
  jacobian.setZero();
  const geometry::Pose base_T_tip =
      Walk(q, [&](const Step& step, const auto& axis, const Eigen::Vector3d& origin) {
        const Eigen::Vector3d rate = step.multiplier * axis;
        if (step.prismatic) {
          jacobian.col(step.variable).template head<3>() += rate;
        } else {
          jacobian.col(step.variable).template head<3>() -= rate.cross(origin);
          jacobian.col(step.variable).template tail<3>() += rate;
        }
      });
  for (int i = 0; i < dof(); ++i) {
    const Eigen::Vector3d axis = jacobian.col(i).tail<3>();
    jacobian.col(i).head<3>() += axis.cross(base_T_tip.translation);
  }
  return base_T_tip;
}

void LinkPoses(const RobotModel& model, const Eigen::Ref<const Eigen::VectorXd>& q,
               std::vector<geometry::Pose>& root_T_links) {
  assert(q.size() == static_cast<Eigen::Index>(model.joints.size()));
  root_T_links.resize(model.links.size());
  root_T_links[0] = geometry::Pose::Identity();
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const Joint& joint = model.joints[i];
    geometry::Pose pose = root_T_links[joint.parent_link] * joint.parent_T_joint;
    if (joint.type != JointType::kFixed) {
      const double value =
          joint.mimic ? joint.mimic->multiplier * q[joint.mimic->joint] + joint.mimic->offset
                      : q[static_cast<Eigen::Index>(i)];
      if (joint.type == JointType::kPrismatic) {
        pose.translation += value * (pose.rotation * joint.axis);
      } else {
        const double s = std::sin(value / 2);
        const Eigen::Quaterniond turn(std::cos(value / 2), s * joint.axis.x(), s * joint.axis.y(),
                                      s * joint.axis.z());
        pose.rotation = pose.rotation * turn;
      }
    }
    root_T_links[joint.child_link] = pose;
  }
}

}  // namespace exemplar::kinematics
