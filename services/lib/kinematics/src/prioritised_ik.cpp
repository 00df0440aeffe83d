#include "exemplar/kinematics/prioritised_ik.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "exemplar/base/rng.hpp"

namespace exemplar::kinematics {
namespace {

constexpr double kLongestStep = 0.3;  // rad or m, of one joint
/// Singular values below this (m or rad of tool a rad of joint) are no way to move.
constexpr double kSmallestGain = 1e-4;
constexpr double kDamping = 2e-3;
/// Of the lower priorities: what those above leave free is often all but singular.
constexpr double kLowerDamping = 0.05;
constexpr int kHalvings = 8;
constexpr int kRestorations = 2;
constexpr double kPosturePull = 0.3;
/// Descents without headway end after so many iterations.
constexpr int kPatience = 12;

class Solver {
 public:
  Solver(const ChainGroup& group, std::span<const ToolTask> tasks,
         const PrioritisedOptions& options)
      : group_(group), tasks_(tasks), options_(options), n_(group.dof()), lower_(n_), upper_(n_) {
    for (int j = 0; j < n_; ++j) {
      lower_[j] = group.limits()[static_cast<std::size_t>(j)].lower;
      upper_[j] = group.limits()[static_cast<std::size_t>(j)].upper;
    }
    for (const ToolTask& task : tasks) levels_.push_back(task.priority);
    std::sort(levels_.begin(), levels_.end());
    levels_.erase(std::unique(levels_.begin(), levels_.end()), levels_.end());
  }

  PrioritisedSolution Solve(const Eigen::VectorXd& seed) {
    Rng rng(options_.random_seed);
    PrioritisedSolution best;
    std::vector<double> best_errors;
    int iterations = 0;
    for (int attempt = 0; attempt <= options_.max_restarts; ++attempt) {
      Eigen::VectorXd q = attempt == 0 ? seed : RandomPosture(rng);
      q = q.cwiseMax(lower_).cwiseMin(upper_);
      iterations += Descend(q);
      const std::vector<double> errors = LevelErrors(q);
      if (attempt == 0 || Better(errors, best_errors)) {
        best.q = q;
        best.restarts = attempt;
        best_errors = errors;
      }
      if (best_errors.empty() || best_errors.front() == 0) break;
    }
    best.iterations = iterations;
    for (const ToolTask& task : tasks_) {
      const Eigen::Matrix<double, 6, 1> error = Error(task, best.q, nullptr);
      best.position_error_m.push_back(error.head<3>().norm());
      best.rotation_error_rad.push_back(error.tail<3>().norm());
      best.tasks_met += Met(error) ? 1 : 0;
    }
    return best;
  }

 private:
  using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

  Eigen::Matrix<double, 6, 1> Error(const ToolTask& task, const Eigen::VectorXd& q,
                                    Eigen::MatrixXd* jacobian) const {
    const Chain& chain = group_.chains()[static_cast<std::size_t>(task.chain)];
    Jacobian own(6, chain.dof());
    const geometry::Pose at = chain.ToolPoseAndJacobian(group_.Of(task.chain, q), own);
    Eigen::Matrix<double, 6, 1> error = Eigen::Matrix<double, 6, 1>::Zero();
    error.head<3>() = task.base_T_tool.translation - at.translation;
    if (task.use_rotation) {
      error.tail<3>() = geometry::LogSo3(task.base_T_tool.rotation * at.rotation.conjugate());
    } else {
      own.bottomRows<3>().setZero();
    }
    if (jacobian != nullptr) {
      jacobian->setZero(6, n_);
      const std::vector<int>& indices = group_.indices(task.chain);
      for (int i = 0; i < chain.dof(); ++i) {
        jacobian->col(indices[static_cast<std::size_t>(i)]) += own.col(i);
      }
    }
    return error;
  }

  bool Met(const Eigen::Matrix<double, 6, 1>& error) const {
    return error.head<3>().norm() <= options_.position_tolerance_m &&
           error.tail<3>().norm() <= options_.rotation_tolerance_rad;
  }

  /// Of each priority, the squared errors of its tasks; 0 where all are met.
  std::vector<double> LevelErrors(const Eigen::VectorXd& q) const {
    std::vector<double> errors(levels_.size(), 0.0);
    for (const ToolTask& task : tasks_) {
      const Eigen::Matrix<double, 6, 1> error = Error(task, q, nullptr);
      if (Met(error)) continue;
      const auto level = std::find(levels_.begin(), levels_.end(), task.priority);
      errors[static_cast<std::size_t>(level - levels_.begin())] += error.squaredNorm();
    }
    return errors;
  }

  static bool Better(const std::vector<double>& a, const std::vector<double>& b) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (std::abs(a[i] - b[i]) > 1e-9 * (a[i] + b[i])) return a[i] < b[i];
    }
    return false;
  }

  Eigen::VectorXd RandomPosture(Rng& rng) const {
    Eigen::VectorXd q(n_);
    for (int j = 0; j < n_; ++j) {
      const bool endless = !std::isfinite(lower_[j]) || !std::isfinite(upper_[j]);
      q[j] = endless ? rng.Uniform(-std::numbers::pi, std::numbers::pi)
                     : rng.Uniform(lower_[j], upper_[j]);
    }
    return q;
  }

  /// The step of the first `count` priorities, the joints of `held` (their steps in `held_step`)
  /// left out; to the posture with what is free after them all, where asked for.
  Eigen::VectorXd HierarchyStep(const Eigen::VectorXd& q, const std::vector<bool>& held,
                                const Eigen::VectorXd& held_step, std::size_t count,
                                bool to_posture) const {
    Eigen::MatrixXd free = Eigen::MatrixXd::Identity(n_, n_);
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n_);
    for (int j = 0; j < n_; ++j) {
      if (!held[static_cast<std::size_t>(j)]) continue;
      free(j, j) = 0;
      step[j] = held_step[j];
    }
    for (std::size_t l = 0; l < count; ++l) {
      const int level = levels_[l];
      const double damping = l == 0 ? kDamping : kLowerDamping;
      int rows = 0;
      for (const ToolTask& task : tasks_) rows += task.priority == level ? 6 : 0;
      Eigen::MatrixXd jacobian(rows, n_);
      Eigen::VectorXd error(rows);
      int row = 0;
      Eigen::MatrixXd one;
      for (const ToolTask& task : tasks_) {
        if (task.priority != level) continue;
        error.segment<6>(row) = Error(task, q, &one);
        jacobian.middleRows<6>(row) = one;
        row += 6;
      }
      const Eigen::MatrixXd within = jacobian * free;
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(within,
                                                  Eigen::ComputeThinU | Eigen::ComputeThinV);
      const Eigen::VectorXd rest = svd.matrixU().transpose() * (error - jacobian * step);
      for (Eigen::Index i = 0; i < svd.singularValues().size(); ++i) {
        const double gain = svd.singularValues()[i];
        if (gain < kSmallestGain) break;
        const Eigen::VectorXd direction = svd.matrixV().col(i);
        step += rest[i] * gain / (gain * gain + damping * damping) * direction;
        free -= direction * direction.transpose();
      }
    }
    if (to_posture && options_.preferred.size() == n_) {
      step += free * (kPosturePull * (options_.preferred - q));
    }
    return step;
  }

  /// The same with joints that it would take across a limit held there.
  Eigen::VectorXd BoundedStep(const Eigen::VectorXd& q, std::size_t count, bool to_posture) const {
    std::vector<bool> held(static_cast<std::size_t>(n_), false);
    Eigen::VectorXd held_step = Eigen::VectorXd::Zero(n_);
    for (;;) {
      Eigen::VectorXd step = HierarchyStep(q, held, held_step, count, to_posture);
      int worst = -1;
      double most = 1e-12;
      for (int j = 0; j < n_; ++j) {
        if (held[static_cast<std::size_t>(j)]) continue;
        const double beyond = std::max(lower_[j] - q[j] - step[j], q[j] + step[j] - upper_[j]);
        if (beyond <= most) continue;
        most = beyond;
        worst = j;
      }
      if (worst < 0) return step;
      held[static_cast<std::size_t>(worst)] = true;
      held_step[worst] = step[worst] > 0 ? upper_[worst] - q[worst] : lower_[worst] - q[worst];
    }
  }

  /// A null space is straight only to first order: the priorities that a step was to leave as they
  /// are get back what it took from them.
  Eigen::VectorXd Restored(Eigen::VectorXd q) const {
    const std::size_t count = std::max<std::size_t>(1, levels_.size() - 1);
    for (int i = 0; i < kRestorations; ++i) {
      const Eigen::VectorXd step = BoundedStep(q, std::min(count, levels_.size()), false);
      if (step.cwiseAbs().maxCoeff() > kLongestStep) break;
      q = (q + step).cwiseMax(lower_).cwiseMin(upper_);
    }
    return q;
  }

  double PostureCost(const Eigen::VectorXd& q) const {
    return options_.preferred.size() == n_ ? (q - options_.preferred).squaredNorm() : 0.0;
  }

  /// Moves q; the number of iterations.
  int Descend(Eigen::VectorXd& q) const {
    std::vector<double> errors = LevelErrors(q);
    double mark = Sum(errors) + PostureCost(q);
    int since_mark = 0;
    for (int i = 0; i < options_.max_iterations; ++i) {
      Eigen::VectorXd step = BoundedStep(q, levels_.size(), true);
      const double longest = step.cwiseAbs().maxCoeff();
      if (longest < 1e-9) return i;
      step *= std::min(1.0, kLongestStep / longest);
      bool moved = false;
      for (int halving = 0; halving < kHalvings && !moved; ++halving, step *= 0.5) {
        const Eigen::VectorXd next = Restored((q + step).cwiseMax(lower_).cwiseMin(upper_));
        const std::vector<double> reached = LevelErrors(next);
        moved = Better(reached, errors) ||
                (!Better(errors, reached) && PostureCost(next) < PostureCost(q) - 1e-12);
        if (!moved) continue;
        q = next;
        errors = reached;
      }
      if (!moved) return i;
      const double now = Sum(errors) + PostureCost(q);
      if (now < 0.99 * mark) {
        mark = now;
        since_mark = 0;
      } else if (++since_mark >= kPatience) {
        return i;
      }
    }
    return options_.max_iterations;
  }

  static double Sum(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return sum;
  }

  const ChainGroup& group_;
  std::span<const ToolTask> tasks_;
  const PrioritisedOptions& options_;
  int n_;
  Eigen::VectorXd lower_, upper_;
  std::vector<int> levels_;  ///< priorities, ascending
};

}  // namespace

Result<ChainGroup> ChainGroup::Create(std::vector<Chain> chains) {
  if (chains.empty()) return InvalidArgument("a group needs at least one chain", "chains");
  ChainGroup group;
  std::vector<int> joints;  // of the model
  for (const Chain& chain : chains) {
    if (chain.base_link() != chains.front().base_link()) {
      return InvalidArgument("the chains of a group start from one link, not from \"" +
                                 chains.front().base_link() + "\" and \"" + chain.base_link() +
                                 "\"",
                             "chains");
    }
    std::vector<int> indices;
    for (int i = 0; i < chain.dof(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      const int joint = chain.joint_indices()[at];
      const auto found = std::find(joints.begin(), joints.end(), joint);
      const auto index = static_cast<std::size_t>(found - joints.begin());
      indices.push_back(static_cast<int>(index));
      if (found == joints.end()) {
        joints.push_back(joint);
        group.names_.push_back(chain.joint_names()[at]);
        group.limits_.push_back(chain.limits()[at]);
      } else {
        JointLimits& limits = group.limits_[index];
        limits.lower = std::max(limits.lower, chain.limits()[at].lower);
        limits.upper = std::min(limits.upper, chain.limits()[at].upper);
      }
    }
    group.indices_.push_back(std::move(indices));
  }
  group.chains_ = std::move(chains);
  return group;
}

Eigen::VectorXd ChainGroup::Of(int chain, const Eigen::Ref<const Eigen::VectorXd>& q) const {
  const std::vector<int>& own = indices(chain);
  Eigen::VectorXd out(static_cast<Eigen::Index>(own.size()));
  for (std::size_t i = 0; i < own.size(); ++i) out[static_cast<Eigen::Index>(i)] = q[own[i]];
  return out;
}

Result<PrioritisedSolution> SolvePrioritised(const ChainGroup& group,
                                             std::span<const ToolTask> tasks,
                                             const Eigen::Ref<const Eigen::VectorXd>& seed,
                                             const PrioritisedOptions& options) {
  assert(seed.size() == group.dof());
  if (!seed.allFinite()) return InvalidArgument("the seed posture is not finite", "seed");
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const ToolTask& task = tasks[i];
    const std::string place = "tasks[" + std::to_string(i) + "]";
    if (task.chain < 0 || task.chain >= static_cast<int>(group.chains().size())) {
      return InvalidArgument(place + " names chain " + std::to_string(task.chain) + " of " +
                                 std::to_string(group.chains().size()),
                             place + ".chain");
    }
    if (!task.base_T_tool.translation.allFinite() ||
        !task.base_T_tool.rotation.coeffs().allFinite() ||
        std::abs(task.base_T_tool.rotation.norm() - 1) > 1e-3) {
      return InvalidArgument(
          place + ": its pose is not finite or its quaternion is not of unit length",
          place + ".base_T_tool");
    }
  }
  return Solver(group, tasks, options).Solve(seed);
}

}  // namespace exemplar::kinematics
