#include "path_errors.hpp"

namespace exemplar::motion {

Vector6 PoseError(const PathProblem& problem, int frame, const geometry::Pose& at) {
  const geometry::Pose& goal = problem.base_T_tool[static_cast<std::size_t>(frame)];
  Vector6 error = Vector6::Zero();
  error.head<3>() = goal.translation - at.translation;
  if (problem.use_rotation) {
    error.tail<3>() = geometry::LogSo3(goal.rotation * at.rotation.conjugate());
  }
  return error;
}

void MeasureErrors(const kinematics::Chain& chain, const PathProblem& problem,
                   PathSolution& solution) {
  const Eigen::Index frames = solution.joints.rows();
  solution.position_error_m.resize(frames);
  solution.rotation_error_rad.resize(frames);
  solution.missed.clear();
  solution.large_steps.clear();
  Eigen::VectorXd q(chain.dof());
  for (int k = 0; k < frames; ++k) {
    q = solution.joints.row(k).transpose();
    const Vector6 error = PoseError(problem, k, chain.ToolPose(q));
    const Tracking& tracking = problem.tracking(static_cast<std::size_t>(k));
    solution.position_error_m[k] = error.head<3>().norm();
    solution.rotation_error_rad[k] = error.tail<3>().norm();
    if (solution.position_error_m[k] > tracking.position_tolerance_m ||
        solution.rotation_error_rad[k] > tracking.rotation_tolerance_rad) {
      solution.missed.push_back(k);
    }
    if (k > 0 && (solution.joints.row(k) - solution.joints.row(k - 1)).cwiseAbs().maxCoeff() >
                     kLargeJointStep_rad) {
      solution.large_steps.push_back(k);
    }
  }
}

}  // namespace exemplar::motion
