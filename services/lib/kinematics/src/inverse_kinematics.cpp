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
constexpr int kNullSpaceIterations = 60;

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
    lower_.resize(n_);
    upper_.resize(n_);
    for (int i = 0; i < n_; ++i) {
      lower_[i] = chain.limits()[i].lower;
      upper_[i] = chain.limits()[i].upper;
    }
    ease_ = Eigen::VectorXd::Ones(n_);
    if (options.preferred_weights.size() == n_) ease_ = options.preferred_weights.cwiseInverse();
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
    if (options_.preferred.size() == n_) ApproachPreferred(solution.iterations);
    solution.q = best_.q;
    solution.position_error_m = best_.position;
    solution.rotation_error_rad = best_.rotation;
    return solution;
  }

 private:
  void Evaluate(Evaluation& e) const {
    const geometry::Pose pose = chain_.ToolPoseAndJacobian(e.q, e.jacobian);
    e.error.head<3>() = goal_.translation - pose.translation;
    e.position = e.error.head<3>().norm();
    if (!options_.use_rotation) {
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
    e.rotation = e.error.tail<3>().norm();
    e.squared = e.error.squaredNorm();
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

  double Cost(const Eigen::VectorXd& away) const {
    return (away.array().square() / ease_.array()).sum();
  }

  /// Moves best_, which meets the pose, along the null space to the least weighted distance to
  /// `preferred`: Newton's steps for the tangent problem, each brought back onto the pose.
  void ApproachPreferred(int& iterations) {
    const Eigen::VectorXd& goal = options_.preferred;
    double longest = kNullSpaceStep;
    double distance = Cost(best_.q - goal);
    for (int i = 0; i < kNullSpaceIterations && longest > 1e-5; ++i) {
      ++iterations;
      const Eigen::VectorXd pull = goal - best_.q;
      BoundedStep(best_, &pull, kSmallestDamping);
      const double largest = step_.cwiseAbs().maxCoeff();
      if (largest < 1e-7) return;
      TakeStep(best_, std::min(1.0, longest / largest), now_);
      if (Restore(iterations)) {
        const double reached = Cost(now_.q - goal);
        if (reached < distance) {
          const bool settled = distance - reached < 1e-13;
          distance = reached;
          std::swap(best_, now_);
          if (settled) return;
          longest = std::min(kNullSpaceStep, 2 * longest);
          continue;
        }
      }
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
  Eigen::VectorXd ease_;  ///< inverse weights
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
  if (!seed.allFinite()) return InvalidArgument("the seed posture is not finite", "seed");
  const geometry::Pose goal = {base_T_tool.translation, base_T_tool.rotation.normalized()};
  return Solver(chain, goal, options).Solve(seed);
}

}  // namespace exemplar::kinematics
