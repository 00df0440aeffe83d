#pragma once
// The inertia matrix of a chain: what a motion of its joints costs in kinetic energy.

#include <Eigen/Core>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/kinematics/chain.hpp"
#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::kinematics {

/// All that a chain's joints carry, side branches included, the root link standing still.
/// Immutable, so thread-safe.
class ChainInertia {
 public:
  /// kFailedPrecondition, naming the joint, when a joint of the chain moves no mass: its URDF has
  /// no `inertial` there, and the matrix would be singular.
  static Result<ChainInertia> Create(const RobotModel& model, const Chain& chain);

  /// M(q), n x n, symmetric positive definite: the kinetic energy is dq' M dq / 2, in J.
  Eigen::MatrixXd MassMatrix(const Eigen::Ref<const Eigen::VectorXd>& q) const;

 private:
  /// A link or joint on the way from the root, as far as moving it matters.
  struct Frame {
    int parent = -1;  ///< index of the frame that carries it
    geometry::Pose parent_T_joint;
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    bool moves = false;
    bool prismatic = false;
    int variable = -1;  ///< of the chain; -1: the joint stays at `value`
    double multiplier = 1;
    double value = 0;  ///< offset, or where a joint outside the chain stands
    bool has_mass = false;
    Inertial inertial = {};
  };
  ChainInertia() = default;

  int dof_ = 0;
  std::vector<Frame> frames_;  ///< parents before children
};

}  // namespace exemplar::kinematics
