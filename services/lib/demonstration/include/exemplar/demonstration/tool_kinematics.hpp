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
};

}  // namespace exemplar::demonstration
