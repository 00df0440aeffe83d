#pragma once
// The paper's ways through a path, frame by frame.

#include "exemplar/motion/path_ik.hpp"

namespace exemplar::motion {

/// PathIkVariant::kPlain.
Eigen::MatrixXd PlainJoints(const kinematics::Chain& chain, const PathProblem& problem);
/// PathIkVariant::kEnergy.
Eigen::MatrixXd LeastEnergyJoints(const kinematics::Chain& chain, const PathProblem& problem,
                                  const kinematics::ChainInertia& inertia);

}  // namespace exemplar::motion
