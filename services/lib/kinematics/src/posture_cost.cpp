#include "exemplar/kinematics/posture_cost.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace exemplar::kinematics {
namespace {

using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

constexpr double kSingular = 1e-12;  // added to squared singular values
constexpr double kClosest = 1e-6;    // to a limit, of the half range
constexpr double kLeastCurvature = 1e-6;

/// log sqrt det(J J') or log sqrt det(J' J); `dual` (6 x n) is its derivative by J.
double LogManipulability(const Jacobian& jacobian, Jacobian* dual) {
  const bool wide = jacobian.cols() >= 6;
  Eigen::MatrixXd square = wide ? Eigen::MatrixXd(jacobian * jacobian.transpose())
                                : Eigen::MatrixXd(jacobian.transpose() * jacobian);
  square.diagonal().array() += kSingular;
  const Eigen::LLT<Eigen::MatrixXd> factor(square);
  if (dual != nullptr) {
    if (wide) {
      *dual = factor.solve(jacobian);
    } else {
      *dual = factor.solve(jacobian.transpose()).transpose();
    }
  }
  return Eigen::MatrixXd(factor.matrixL()).diagonal().array().log().sum();
}

double Manipulability(const Chain& chain, const Eigen::Ref<const Eigen::VectorXd>& q,
                      Eigen::VectorXd& gradient) {
  const int n = chain.dof();
  Jacobian jacobian(6, n);
  Jacobian dual(6, n);
  chain.ToolPoseAndJacobian(q, jacobian);
  const double value = LogManipulability(jacobian, &dual);
  gradient.setZero(n);
  if (chain.has_shared_joints()) {
    constexpr double kStep = 1e-5;
    Eigen::VectorXd moved = q;
    for (int i = 0; i < n; ++i) {
      moved[i] = q[i] + kStep;
      chain.ToolPoseAndJacobian(moved, jacobian);
      const double above = LogManipulability(jacobian, nullptr);
      moved[i] = q[i] - kStep;
      chain.ToolPoseAndJacobian(moved, jacobian);
      gradient[i] = (above - LogManipulability(jacobian, nullptr)) / (2 * kStep);
      moved[i] = q[i];
    }
    return value;
  }
  // Joint i turns the columns of the joints behind it, and moves the tip of those before it.
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d v = jacobian.col(i).head<3>();
    const Eigen::Vector3d w = jacobian.col(i).tail<3>();
    for (int c = 0; c < n; ++c) {
      const Eigen::Vector3d column_v = jacobian.col(c).head<3>();
      const Eigen::Vector3d column_w = jacobian.col(c).tail<3>();
      if (i <= c) {
        gradient[i] += dual.col(c).head<3>().dot(w.cross(column_v)) +
                       dual.col(c).tail<3>().dot(w.cross(column_w));
      } else {
        gradient[i] += dual.col(c).head<3>().dot(column_w.cross(v));
      }
    }
  }
  return value;
}

}  // namespace

double EvaluatePostureCost(const Chain& chain, const PostureCost& cost,
                           const Eigen::Ref<const Eigen::VectorXd>& q,
                           Eigen::Ref<Eigen::VectorXd> gradient,
                           Eigen::Ref<Eigen::VectorXd> curvature) {
  const int n = chain.dof();
  assert(q.size() == n && gradient.size() == n && curvature.size() == n);
  double value = 0;
  gradient.setZero();
  curvature.setConstant(kLeastCurvature);
  if (cost.preferred.size() == n) {
    const Eigen::VectorXd away = q - cost.preferred;
    const Eigen::VectorXd weights =
        cost.preferred_weights.size() == n ? cost.preferred_weights : Eigen::VectorXd::Ones(n);
    gradient += weights.cwiseProduct(away);
    curvature += weights;
    value += 0.5 * away.dot(weights.cwiseProduct(away));
  }
  if (cost.limits_weight > 0) {
    const double weight = cost.limits_weight / n;
    for (int i = 0; i < n; ++i) {
      const JointLimits& limits = chain.limits()[static_cast<std::size_t>(i)];
      const double half = 0.5 * (limits.upper - limits.lower);
      if (!std::isfinite(half) || half <= 0) continue;
      const double inside = 1 - kClosest;
      const double u =
          std::clamp((q[i] - 0.5 * (limits.upper + limits.lower)) / half, -inside, inside);
      const double room = 1 - u * u;
      value += 0.5 * weight * u * u / room;
      gradient[i] += weight * u / (room * room * half);
      curvature[i] += weight * (1 + 3 * u * u) / (room * room * room * half * half);
    }
  }
  if (cost.manipulability_weight > 0) {
    Eigen::VectorXd slope(n);
    value -= cost.manipulability_weight * Manipulability(chain, q, slope);
    gradient -= cost.manipulability_weight * slope;
    curvature.array() += cost.manipulability_weight * (1 + slope.array().square());
  }
  if (cost.energy_from.size() == n) {
    const Eigen::VectorXd away = q - cost.energy_from;
    const Eigen::VectorXd momentum = cost.energy_metric * away;
    value += 0.5 * away.dot(momentum);
    gradient += momentum;
    // Gershgorin's bound keeps a descent by the diagonal alone from overshooting.
    curvature += cost.energy_metric.cwiseAbs().rowwise().sum();
  }
  return value;
}

}  // namespace exemplar::kinematics
