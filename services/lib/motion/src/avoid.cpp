#include "avoid.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::motion {
namespace {

/// So long before something is near the joints begin to turn away.
constexpr double kNotice_s = 0.5;
/// How closely the joints keep to the style that leads away.
constexpr double kAvoidingDeviation_rad = 0.1;
constexpr double kLargestShift_rad = 0.4;
constexpr double kDamping = 1e-6;
/// How far from the axes about which the free joints turn them bodies lie, about.
constexpr double kLever_m = 0.3;
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
    // What takes a body at this lever as far away as its distance lacks. The step that makes the
    // whole cost vanish would be wild where most of the cost is of pairs that the null space cannot
    // move.
    Eigen::VectorXd step = -free / (2 * kLever_m * kLever_m);
    if (step.norm() > kLargestShift_rad) step *= kLargestShift_rad / step.norm();
    shift.row(k) = step.transpose();
    near[static_cast<std::size_t>(k)] = true;
    any = true;
  }
  if (!any) return std::nullopt;
  PathProblem away = problem;
  away.style_deviation_rad = problem.style_deviation_rad.cwiseMin(kAvoidingDeviation_rad);
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
    // The answer so far is the style elsewhere, so that what was won stays.
    away.style.row(k) = joints.row(k);
    if (weight > 0) away.style.row(k) += weight * mean / sum;
  }
  return away;
}

}  // namespace exemplar::motion
