#pragma once
// How far joints are from what a path asks.

#include <Eigen/Core>

#include "exemplar/motion/path_ik.hpp"

namespace exemplar::motion {

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Linear (m) and angular (rad) way from `at` to the frame's pose, in the base frame.
Vector6 PoseError(const PathProblem& problem, int frame, const geometry::Pose& at);

/// Fills in what solution.joints leaves: errors, frames missed, large steps.
void MeasureErrors(const kinematics::Chain& chain, const PathProblem& problem,
                   PathSolution& solution);

}  // namespace exemplar::motion
