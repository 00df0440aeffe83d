#include "path_variants.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>

#include "path_errors.hpp"

namespace exemplar::motion {
namespace {

constexpr int kMostSteps = 100;
constexpr double kThere = 1e-9;         // m and rad
constexpr double kLongestStep = 0.1;    // rad or m, of one joint
constexpr double kSmallestGain = 1e-6;  // of a singular value beside the largest: below, it is none

using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// From q to the frame's pose by differential steps; `root` (n x n) is the inverse square root of
/// the metric in which a step is shortest, empty for the identity.
Eigen::VectorXd StepTo(const kinematics::Chain& chain, const PathProblem& problem, int frame,
                       Eigen::VectorXd q, const Eigen::MatrixXd& root) {
  Jacobian jacobian(6, chain.dof());
  for (int i = 0; i < kMostSteps; ++i) {
    const Vector6 error = PoseError(problem, frame, chain.ToolPoseAndJacobian(q, jacobian));
    if (error.norm() < kThere) break;
    if (!problem.use_rotation) jacobian.bottomRows<3>().setZero();
    Eigen::MatrixXd scaled = jacobian;
    if (root.size() > 0) scaled = jacobian * root;
    Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled, Eigen::ComputeThinU | Eigen::ComputeThinV);
    svd.setThreshold(kSmallestGain);
    Eigen::VectorXd step = svd.solve(error);
    if (root.size() > 0) step = root * step;
    const double longest = step.cwiseAbs().maxCoeff();
    q += step * std::min(1.0, kLongestStep / std::max(longest, 1e-300));
  }
  return q;
}

}  // namespace

Eigen::MatrixXd PlainJoints(const kinematics::Chain& chain, const PathProblem& problem) {
  Eigen::MatrixXd joints = problem.style;
  for (int k = 0; k < joints.rows(); ++k) {
    joints.row(k) = StepTo(chain, problem, k, problem.style.row(k).transpose(), {}).transpose();
  }
  return joints;
}

Eigen::MatrixXd LeastEnergyJoints(const kinematics::Chain& chain, const PathProblem& problem,
                                  const kinematics::ChainInertia& inertia) {
  Eigen::MatrixXd joints = problem.style;
  Eigen::VectorXd q = problem.style.row(0).transpose();
  for (int k = 0; k < joints.rows(); ++k) {
    // With M = L L' a step is shortest in the metric M when its image under L' is: root = L'^-1.
    const Eigen::LLT<Eigen::MatrixXd> factor(inertia.MassMatrix(q));
    const Eigen::MatrixXd root =
        factor.matrixU().solve(Eigen::MatrixXd::Identity(chain.dof(), chain.dof()));
    q = StepTo(chain, problem, k, q, root);
    joints.row(k) = q.transpose();
  }
  return joints;
}

}  // namespace exemplar::motion
