#include "avoid.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::motion {
namespace {

/// A quarter of a second before something is near the joints begin to turn away.
constexpr double kNotice_s = 0.25;
constexpr double kLargestShift_rad = 0.4;
constexpr double kDamping = 1e-6;
/// Of the gradient: less of it in the null space is no freedom to speak of.
constexpr double kLeastFreedom = 1e-2;

/// The part of `gradient` along which the tool stays where it is.
Eigen::VectorXd InNullSpace(const kinematics::Chain& chain, const Eigen::VectorXd& q,
                            bool use_rotation, const Eigen::VectorXd& gradient) {
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, chain.dof());
  chain.ToolPoseAndJacobian(q, jacobian);
  const Eigen::MatrixXd task = jacobian.topRows(use_rotation ? 6 : 3);
  const Eigen::MatrixXd square =
      task * task.transpose() + kDamping * Eigen::MatrixXd::Identity(task.rows(), task.rows());
  return gradient - task.transpose() * square.ldlt().solve(task * gradient);
}

}  // namespace

std::optional<PathProblem> AwayFromObstacles(const kinematics::RobotModel& model,
                                             const kinematics::Chain& chain,
                                             const collision::CollisionChecker& checker,
                                             const PathProblem& problem,
                                             const Eigen::MatrixXd& joints,
                                             const FrameTouches& touches, double margin_m) {
  const Eigen::Index frames = joints.rows();
  Eigen::MatrixXd shift = Eigen::MatrixXd::Zero(frames, joints.cols());
  std::vector<bool> near(static_cast<std::size_t>(frames), false);
  const std::vector<collision::AllowedTouch> none;
  Eigen::VectorXd gradient;
  bool any = false;
  for (Eigen::Index k = 0; k < frames; ++k) {
    const Eigen::VectorXd q = joints.row(k).transpose();
    const double cost = checker.NearnessCost(
        kinematics::FullJointVector(model, chain, q), margin_m,
        touches.empty() ? none : touches[static_cast<std::size_t>(k)], &gradient);
    if (cost <= 0) continue;
    Eigen::VectorXd along(chain.dof());
    for (int j = 0; j < chain.dof(); ++j) along[j] = gradient[chain.joint_indices()[j]];
    const Eigen::VectorXd free = InNullSpace(chain, q, problem.use_rotation, along);
    if (free.norm() < kLeastFreedom * along.norm()) continue;
    // One Gauss-Newton step: linearly, the cost of one near pair vanishes there.
    Eigen::VectorXd step = -2 * cost / along.dot(free) * free;
    if (step.norm() > kLargestShift_rad) step *= kLargestShift_rad / step.norm();
    shift.row(k) = step.transpose();
    near[static_cast<std::size_t>(k)] = true;
    any = true;
  }
  if (!any) return std::nullopt;
  PathProblem away = problem;
  for (Eigen::Index k = 0; k < frames; ++k) {
    double weight = 0;
    double sum = 0;
    Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(joints.cols());
    for (Eigen::Index other = 0; other < frames; ++other) {
      if (!near[static_cast<std::size_t>(other)]) continue;
      const double apart_s = std::abs(problem.time_s[static_cast<std::size_t>(other)] -
                                      problem.time_s[static_cast<std::size_t>(k)]);
      const double share = std::max(0.0, 1 - apart_s / kNotice_s);
      weight = std::max(weight, share);
      sum += share;
      mean += share * shift.row(other);
    }
    if (weight <= 0) continue;
    away.style.row(k) = (1 - weight) * problem.style.row(k) + weight * (joints.row(k) + mean / sum);
  }
  return away;
}

}  // namespace exemplar::motion
