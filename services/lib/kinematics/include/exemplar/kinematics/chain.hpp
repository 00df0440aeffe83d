#pragma once
// A serial chain of a robot: forward kinematics and Jacobians.

#include <Eigen/Core>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/demonstration/tool_kinematics.hpp"
#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::kinematics {

/// The movable joints between two links of a tree, up from `base` and down to `tip` where neither
/// is above the other. A mimic joint moves with its leader, which is a joint of the chain even if
/// it lies elsewhere. Immutable, so thread-safe.
class Chain final : public demonstration::ToolKinematics {
 public:
  /// `base` empty: the root link. `tip` empty: the link "tool" if there is one, else the only leaf.
  /// Errors name the link and offer the nearest name.
  static Result<Chain> Create(const RobotModel& model, std::string_view base, std::string_view tip);

  int dof() const { return static_cast<int>(names_.size()); }
  const std::vector<std::string>& joint_names() const override { return names_; }
  const std::vector<JointLimits>& limits() const { return limits_; }
  const std::string& base_link() const { return base_link_; }
  const std::string& tip_link() const { return tip_link_; }
  /// Whether mimic joints make one variable move several joints of the chain.
  bool has_shared_joints() const { return steps_.size() != names_.size(); }
  /// Indices into RobotModel::joints, base to tip.
  const std::vector<int>& joint_indices() const { return joint_indices_; }

  /// base_T_tip at q (n = dof()).
  geometry::Pose ToolPose(const Eigen::Ref<const Eigen::VectorXd>& q) const override;
  /// Four rows at a time.
  Path ToolPath(const Eigen::MatrixXd& joints) const override;
  /// base_T_tip and the geometric Jacobian (6 x n): rows 0-2 linear velocity of the tip's origin,
  /// 3-5 angular velocity, both in the base frame. Does not allocate.
  geometry::Pose ToolPoseAndJacobian(
      const Eigen::Ref<const Eigen::VectorXd>& q,
      Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> jacobian) const;

 private:
  class Builder;
  struct Step {
    Eigen::Matrix3d before_R_z;  ///< fixed, from the previous joint; the joint's axis is z
    Eigen::Vector3d before_p;
    bool prismatic = false;
    int variable = 0;  ///< index into q: mimic joints share their leader's
    double multiplier = 1;
    double offset = 0;
  };
  Chain() = default;
  template <class Visit>
  geometry::Pose Walk(const Eigen::Ref<const Eigen::VectorXd>& q, Visit&& visit) const;

  std::vector<std::string> names_;
  std::vector<JointLimits> limits_;
  std::vector<int> joint_indices_;
  std::vector<Step> steps_;
  Eigen::Matrix3d last_R_tip_;
  Eigen::Vector3d last_p_tip_;
  bool plain_ = true;  ///< only rotations, each with a variable of its own
  std::string base_link_, tip_link_;
};

/// root_T_link of every link of the model, in the order of model.links. `q` by joint index of the
/// model (fixed joints' values are ignored; mimic joints' values are derived).
void LinkPoses(const RobotModel& model, const Eigen::Ref<const Eigen::VectorXd>& q,
               std::vector<geometry::Pose>& root_T_links);

}  // namespace exemplar::kinematics
