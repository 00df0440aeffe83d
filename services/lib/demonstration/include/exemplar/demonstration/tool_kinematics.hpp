#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "exemplar/geometry/pose.hpp"

namespace exemplar::demonstration {

/// Where the tool is for given joints: the port through which the learner sees a robot model.
/// Implemented by kinematics. Implementations are thread-safe for const use.
class ToolKinematics {
 public:
  virtual ~ToolKinematics() = default;
  /// The chain's joints, base to tip, in the order ToolPose takes them.
  virtual const std::vector<std::string>& joint_names() const = 0;
  /// base_T_tool at `q` (joint_names().size() values, rad or m).
  virtual geometry::Pose ToolPose(const Eigen::Ref<const Eigen::VectorXd>& q) const = 0;

  /// Many poses, one a row: x y z (m), and qx qy qz qw.
  struct Path {
    Eigen::MatrixX3d positions;
    Eigen::MatrixX4d rotations;
  };
  /// ToolPose of each row of `joints`, to rounding.
  virtual Path ToolPath(const Eigen::MatrixXd& joints) const {
    Path path = {Eigen::MatrixX3d(joints.rows(), 3), Eigen::MatrixX4d(joints.rows(), 4)};
    for (Eigen::Index i = 0; i < joints.rows(); ++i) {
      const geometry::Pose pose = ToolPose(joints.row(i).transpose());
      path.positions.row(i) = pose.translation.transpose();
      path.rotations.row(i) = pose.rotation.coeffs().transpose();
    }
    return path;
  }
};

}  // namespace exemplar::demonstration
