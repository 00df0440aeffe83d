#include "exemplar/kinematics/inverse_kinematics.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

#include "exemplar/base/rng.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::kinematics {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

constexpr double kSmallestDamping = 1e-10;
constexpr double kLargestDamping = 1e3;
constexpr double kLargestStep = 1.0;  // rad or m, of one joint
/// A descent that has not halved its squared error in so many iterations starts elsewhere.
constexpr int kPatience = 8;
constexpr double kNullSpaceStep = 0.5;
constexpr double kNearestPlace_m = 1e-6;

/// Task error and Jacobian at one posture.
struct Evaluation {
  Eigen::VectorXd q;
  Jacobian jacobian;
  Vector6 error;     ///< linear (m), angular (rad), base frame: what the step has to make up
  Matrix6 untasked;  ///< projector on the directions of the task space that are free
  double squared = 0;
  double position = 0;
  double rotation = 0;
};

class Solver {
 public:
  Solver(const Chain& chain, const geometry::Pose& goal, const IkOptions& options)
      : chain_(chain),
        goal_(goal),
        options_(options),
        n_(chain.dof()),
        step_(n_),
        ease_(n_),
        fixed_(n_) {
    for (Evaluation* e : {&now_, &next_, &best_}) {
      e->q.resize(n_);
      e->jacobian.resize(6, n_);
      e->untasked.setZero();
    }
    slack_ = options.position_slack_m.maxCoeff() > 0 || options.rotation_slack_rad.maxCoeff() > 0;
    costs_ = !options.posture.empty();
    lower_.resize(n_);
    upper_.resize(n_);
    for (int i = 0; i < n_; ++i) {
      lower_[i] = chain.limits()[i].lower;
      upper_[i] = chain.limits()[i].upper;
    }
    weights_ = Eigen::VectorXd::Ones(n_);
    if (options.preferred_weights.size() == n_) weights_ = options.preferred_weights;
  }

  Result<IkSolution> Solve(const Eigen::Ref<const Eigen::VectorXd>& seed) {
    Rng rng(options_.random_seed);
    now_.q = seed.cwiseMax(lower_).cwiseMin(upper_);
    IkSolution solution;
    for (int attempt = 0;; ++attempt) {
      solution.restarts = attempt;
      Evaluate(now_);
      const bool met = Descend(solution.iterations);
      if (met || attempt == 0 || now_.squared < best_.squared) std::swap(best_, now_);
      if (met) break;
      if (attempt == options_.max_restarts) return NotMet();
      RandomPosture(rng);
    }
    if (options_.preferred.size() == n_ || costs_) Improve(solution.iterations);
    solution.q = best_.q;
    solution.position_error_m = best_.position;
    solution.rotation_error_rad = best_.rotation;
    return solution;
  }

 private:
  void Evaluate(Evaluation& e) const {
    const geometry::Pose pose = chain_.ToolPoseAndJacobian(e.q, e.jacobian);
    e.error.head<3>() = goal_.translation - pose.translation;
    if (options_.point_at) {
      PointAt(pose, e);
    } else if (!options_.use_rotation) {
      e.error.tail<3>().setZero();
      e.jacobian.bottomRows<3>().setZero();
      e.untasked.bottomRightCorner<3, 3>().setIdentity();
    } else if (options_.free_tool_roll) {
      const Eigen::Vector3d z = pose.rotation * Eigen::Vector3d::UnitZ();
      const Eigen::Vector3d wanted = goal_.rotation * Eigen::Vector3d::UnitZ();
      e.error.tail<3>() = geometry::LogSo3(Eigen::Quaterniond::FromTwoVectors(z, wanted));
      for (int i = 0; i < n_; ++i) {
        const double roll = z.dot(e.jacobian.col(i).tail<3>());
        e.jacobian.col(i).tail<3>() -= roll * z;
      }
      e.untasked.bottomRightCorner<3, 3>().noalias() = z * z.transpose();
    } else {
      e.error.tail<3>() = geometry::LogSo3(goal_.rotation * pose.rotation.conjugate());
    }
    if (slack_) TakeOffSlack(e);
    e.position = e.error.head<3>().norm();
    e.rotation = e.error.tail<3>().norm();
    e.squared = e.error.squaredNorm();
  }

  /// The turn from the tool's z axis to the direction of the place. That direction changes as the
  /// tool moves: for a velocity v, by -u x v / distance.
  void PointAt(const geometry::Pose& pose, Evaluation& e) const {
    const Eigen::Vector3d way = *options_.point_at - pose.translation;
    const double distance = std::max(way.norm(), kNearestPlace_m);
    const Eigen::Vector3d u = way / distance;
    const Eigen::Vector3d z = pose.rotation * Eigen::Vector3d::UnitZ();
    e.error.tail<3>() = geometry::LogSo3(Eigen::Quaterniond::FromTwoVectors(z, u));
    for (int i = 0; i < n_; ++i) {
      const Eigen::Vector3d v = e.jacobian.col(i).head<3>();
      const Eigen::Vector3d turn = e.jacobian.col(i).tail<3>();
      e.jacobian.col(i).tail<3>() = turn - z.dot(turn) * z + u.cross(v) / distance;
    }
    e.untasked.bottomRightCorner<3, 3>().noalias() = z * z.transpose();
  }

  /// Turns error and Jacobian into the goal's frame and leaves of each component what is beyond its
  /// slack; components within it are no task.
  void TakeOffSlack(Evaluation& e) const {
    const Eigen::Matrix3d goal_R_base = goal_.rotation.toRotationMatrix().transpose();
    e.error.head<3>() = goal_R_base * e.error.head<3>();
    e.jacobian.topRows<3>() = (goal_R_base * e.jacobian.topRows<3>()).eval();
    const bool turns = options_.use_rotation && !options_.free_tool_roll && !options_.point_at;
    e.untasked.topLeftCorner<3, 3>().setZero();
    if (turns) {
      const Eigen::Vector3d turn = goal_R_base * e.error.tail<3>();
      // A small turn w changes the rotation vector r by the inverse of the right Jacobian of SO(3)
      // at r (Chirikjian 2011), which far from r = 0 is not the identity.
      const double angle = turn.norm();
      Eigen::Matrix3d cross;
      cross << 0, -turn.z(), turn.y(), turn.z(), 0, -turn.x(), -turn.y(), turn.x(), 0;
      Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity() + 0.5 * cross;
      if (angle > 1e-4) {
        const double part = 1 / (angle * angle) -
                            (1 + std::cos(angle)) / (2 * angle * std::max(std::sin(angle), 1e-9));
        inverse += part * cross * cross;
      } else {
        inverse += cross * cross / 12;
      }
      e.error.tail<3>() = turn;
      e.jacobian.bottomRows<3>() = (inverse * goal_R_base * e.jacobian.bottomRows<3>()).eval();
      e.untasked.bottomRightCorner<3, 3>().setZero();
    }
    for (int row = 0; row < (turns ? 6 : 3); ++row) {
      const double slack =
          row < 3 ? options_.position_slack_m[row] : options_.rotation_slack_rad[row - 3];
      double& error = e.error[row];
      error = std::copysign(std::max(0.0, std::abs(error) - slack), error);
      if (error != 0 || slack == 0) continue;
      e.jacobian.row(row).setZero();
      e.untasked(row, row) = 1;
    }
  }

  bool Met(const Evaluation& e) const {
    return e.position <= options_.position_tolerance_m &&
           e.rotation <= options_.rotation_tolerance_rad;
  }

  /// step_ = argmin |J step - (error - J pull)|^2 + damping |step - pull|^2 within the limits:
  /// joints that the step would take across a limit end on it, and the others make up for them.
  void BoundedStep(const Evaluation& e, const Eigen::VectorXd* pull, double damping) {
    fixed_.setConstant(false);
    if (pull == nullptr) {
      for (int i = 0; i < n_; ++i) {
        const double push = e.jacobian.col(i).dot(e.error);
        fixed_[i] = (e.q[i] <= lower_[i] && push < 0) || (e.q[i] >= upper_[i] && push > 0);
        step_[i] = 0;
      }
    }
    for (int round = 0; round <= n_; ++round) {
      Matrix6 normal = e.untasked;
      normal.diagonal().array() += damping;
      Vector6 rest = e.error;
      for (int i = 0; i < n_; ++i) {
        const auto column = e.jacobian.col(i);
        if (fixed_[i]) {
          rest -= step_[i] * column;
        } else {
          const double ease = pull != nullptr ? ease_[i] : 1.0;
          normal.noalias() += ease * (column * column.transpose());
          if (pull != nullptr) rest -= (*pull)[i] * column;
        }
      }
      const Vector6 multipliers = normal.ldlt().solve(rest);
      bool crossed = false;
      for (int i = 0; i < n_; ++i) {
        if (fixed_[i]) continue;
        step_[i] = e.jacobian.col(i).dot(multipliers);
        if (pull != nullptr) step_[i] = ease_[i] * step_[i] + (*pull)[i];
        const double bounded = std::clamp(e.q[i] + step_[i], lower_[i], upper_[i]) - e.q[i];
        if (bounded == step_[i]) continue;
        if (std::abs(bounded - step_[i]) < 1e-14) {
          step_[i] = bounded;
          continue;
        }
        step_[i] = bounded;
        fixed_[i] = true;
        crossed = true;
      }
      if (!crossed) return;
    }
  }

  void TakeStep(const Evaluation& from, double scale, Evaluation& to) const {
    // Rounding alone may lead an ulp across a bound that the step was cut to.
    to.q = (from.q + scale * step_).cwiseMax(lower_).cwiseMin(upper_);
    Evaluate(to);
  }

  bool Descend(int& iterations) {
    double damping = 1e-2 * std::min(1.0, now_.squared);
    double growth = 2;
    double mark = now_.squared;
    int since_mark = 0;
    for (int i = 0; i < options_.max_iterations; ++i) {
      if (Met(now_)) return true;
      ++iterations;
      BoundedStep(now_, nullptr, damping);
      const double largest = step_.cwiseAbs().maxCoeff();
      if (!(largest > 1e-12)) return false;
      const double scale = std::min(1.0, kLargestStep / largest);
      TakeStep(now_, scale, next_);
      const double predicted =
          now_.squared - (now_.error - scale * (now_.jacobian * step_)).squaredNorm();
      const double gained = now_.squared - next_.squared;
      if (gained > 1e-4 * predicted && gained > 0) {
        const double ratio = gained / predicted;
        std::swap(now_, next_);
        damping *= std::max(1.0 / 9.0, 1 - std::pow(2 * ratio - 1, 3));
        damping = std::max(damping, kSmallestDamping);
        growth = 2;
      } else {
        damping = std::max(damping, 1e-6) * growth;
        growth *= 2;
        if (damping > kLargestDamping) return Met(now_);
      }
      if (now_.squared < 0.5 * mark) {
        mark = now_.squared;
        since_mark = 0;
      } else if (++since_mark >= kPatience) {
        return Met(now_);
      }
    }
    return Met(now_);
  }

  /// Back onto the pose from nearby, from now_.
  bool Restore(int& iterations) {
    for (int i = 0; i < 5; ++i) {
      if (Met(now_)) return true;
      ++iterations;
      BoundedStep(now_, nullptr, kSmallestDamping);
      if (step_.cwiseAbs().maxCoeff() > kNullSpaceStep) return false;
      TakeStep(now_, 1.0, next_);
      if (next_.squared >= now_.squared) return false;
      std::swap(now_, next_);
    }
    return Met(now_);
  }

  /// What `preferred` and the other costs say of q. pull_ becomes the step to their minimum where
  /// nothing holds, ease_ the inverse of their curvature.
  double Cost(const Eigen::VectorXd& q) {
    double cost = 0;
    Eigen::VectorXd slope = Eigen::VectorXd::Zero(n_);
    Eigen::VectorXd curvature = Eigen::VectorXd::Zero(n_);
    if (costs_) {
      cost = EvaluatePostureCost(chain_, options_.posture, q, slope, curvature);
    }
    if (options_.preferred.size() == n_) {
      const Eigen::VectorXd away = q - options_.preferred;
      cost += 0.5 * away.dot(weights_.cwiseProduct(away));
      slope += weights_.cwiseProduct(away);
      curvature += weights_;
    }
    ease_ = curvature.cwiseInverse();
    pull_ = -ease_.cwiseProduct(slope);
    return cost;
  }

  /// Moves best_, which meets the pose, along the null space to the least cost: Newton's steps for
  /// the tangent problem, with the diagonal of the Hessian, each brought back onto the pose.
  void Improve(int& iterations) {
    double longest = kNullSpaceStep;
    double cost = Cost(best_.q);
    for (int i = 0; i < options_.max_null_space_iterations && longest > 1e-5; ++i) {
      ++iterations;
      BoundedStep(best_, &pull_, kSmallestDamping);
      const double largest = step_.cwiseAbs().maxCoeff();
      if (largest < 1e-7) return;
      TakeStep(best_, std::min(1.0, longest / largest), now_);
      if (Restore(iterations)) {
        const double reached = Cost(now_.q);
        if (reached < cost) {
          const bool settled = cost - reached < 5e-14;
          cost = reached;
          std::swap(best_, now_);
          if (settled) return;
          longest = std::min(kNullSpaceStep, 2 * longest);
          continue;
        }
      }
      (void)Cost(best_.q);
      longest = 0.5 * std::min(longest, largest);
    }
  }

  void RandomPosture(Rng& rng) {
    for (int i = 0; i < n_; ++i) {
      const bool endless = !std::isfinite(lower_[i]) || !std::isfinite(upper_[i]);
      now_.q[i] = endless ? rng.Uniform(-std::numbers::pi, std::numbers::pi)
                          : rng.Uniform(lower_[i], upper_[i]);
    }
  }

  Error NotMet() const {
    return FailedPrecondition(
        "no posture within limits puts \"" + chain_.tip_link() + "\" at (" +
        FormatFixed(goal_.translation.x(), 4) + ", " + FormatFixed(goal_.translation.y(), 4) +
        ", " + FormatFixed(goal_.translation.z(), 4) + ") m: nearest is " +
        FormatFixed(1e3 * best_.position, 3) + " mm and " + FormatFixed(best_.rotation, 5) +
        " rad away after " + std::to_string(options_.max_restarts) + " restarts");
  }

  const Chain& chain_;
  const geometry::Pose& goal_;
  const IkOptions& options_;
  const int n_;
  Eigen::VectorXd lower_, upper_, step_;
  Eigen::VectorXd weights_;      ///< of `preferred`
  Eigen::VectorXd ease_, pull_;  ///< see Cost
  bool slack_ = false;
  bool costs_ = false;
  Eigen::Array<bool, Eigen::Dynamic, 1> fixed_;
  Evaluation now_, next_, best_;
};

}  // namespace

Result<IkSolution> SolveIk(const Chain& chain, const geometry::Pose& base_T_tool,
                           const Eigen::Ref<const Eigen::VectorXd>& seed,
                           const IkOptions& options) {
  assert(seed.size() == chain.dof());
  if (!base_T_tool.translation.allFinite() || !base_T_tool.rotation.coeffs().allFinite() ||
      std::abs(base_T_tool.rotation.norm() - 1) > 1e-3) {
    return InvalidArgument("the wanted pose of \"" + chain.tip_link() +
                               "\" is not finite or its quaternion is not of unit length",
                           "base_T_tool");
  }
  const auto is_slack = [](const Eigen::Vector3d& slack) { return (slack.array() >= 0).all(); };
  if (!is_slack(options.position_slack_m) || !is_slack(options.rotation_slack_rad)) {
    return InvalidArgument("a slack is negative or no number", "slack");
  }
  if (options.point_at && !options.point_at->allFinite()) {
    return InvalidArgument("the place to point at is not finite", "point_at");
  }
  if (!seed.allFinite()) return InvalidArgument("the seed posture is not finite", "seed");
  const geometry::Pose goal = {base_T_tool.translation, base_T_tool.rotation.normalized()};
  return Solver(chain, goal, options).Solve(seed);
}

}  // namespace exemplar::kinematics
