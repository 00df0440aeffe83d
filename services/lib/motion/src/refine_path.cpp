#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "banded.hpp"
#include "exemplar/motion/path_ik.hpp"
#include "path_errors.hpp"

namespace exemplar::motion {
namespace {

constexpr double kFirst_rad = 2e-3;
// Ordinary rates of the distance to the style; each term is divided by its own.
constexpr double kVelocity_rad_per_s = 1.5;
constexpr double kJerk_rad_per_s3 = 150;
/// Of the path variant: what a squared radian off the style costs beside a squared radian of step.
constexpr double kPathStyle = 1e-6;

/// Tracking errors below these are ordinary while the path finds its shape: along a tight equality
/// every step would be cut short by the curvature of what it must not leave.
constexpr double kEasings[] = {3e-3, 3e-4, 0};
constexpr int kMostIterations[] = {6, 3, 8};
constexpr double kSettled[] = {1e-2, 1e-2, 1e-5};
/// Of the path variant, which has to go further from where it begins: finer, and more of all that.
constexpr double kPathSettled = 0.01;
constexpr int kPathPatience = 5;
constexpr int kMostRefusals = 4;
/// Systems solved, at most, by the end of each stage: a path that cannot be followed costs no more.
constexpr int kMostSystems[] = {8, 12, 26};
constexpr int kActiveSetRounds = 4;
constexpr double kLimitMargin = 2e-3;  // rad or m

double Square(double x) { return x * x; }

class Refiner {
 public:
  Refiner(const kinematics::Chain& chain, const PathProblem& problem, const Branch& guess,
          PathIkVariant variant)
      : chain_(chain),
        problem_(problem),
        guess_(guess),
        frames_(static_cast<int>(problem.base_T_tool.size())),
        n_(chain.dof()),
        bounds_(PathBounds(chain)),
        normal_(frames_ * n_, 4 * n_ - 1),
        factor_(frames_ * n_, 4 * n_ - 1),
        gradient_(frames_ * n_),
        step_(frames_ * n_),
        held_(static_cast<std::size_t>(frames_ * n_), 0),
        jacobian_(6, n_),
        q_(n_) {
    const double interval = problem.time_s.back() / (frames_ - 1);
    smooth_.setZero(frames_, 4);
    style_ = problem.style;
    if (variant == PathIkVariant::kPath) {
      patience_ = kPathPatience;
      settled_ = kPathSettled;
      const double weight = 1 / Square(kVelocity_rad_per_s * interval);
      style_weight_ = Eigen::ArrayXd::Constant(n_, kPathStyle * weight);
      // Steps themselves count, not those off the style.
      style_ = problem.style.row(0).replicate(frames_, 1);
      AddDifferences({-1, 1}, weight);
    } else {
      style_weight_ = problem.style_deviation_rad.array().square().inverse();
      AddDifferences({-1, 1}, problem.smoothness / Square(kVelocity_rad_per_s * interval));
      AddDifferences({-1, 3, -3, 1},
                     problem.smoothness / Square(kJerk_rad_per_s3 * std::pow(interval, 3)));
    }
  }

  PathSolution Solve(std::stop_token stop) {
    PathSolution solution;
    solution.joints = guess_.joints;
    Clamp(solution.joints);
    Eigen::MatrixXd trial(frames_, n_);
    for (std::size_t stage = 0; stage < std::size(kEasings); ++stage) {
      easing_ = kEasings[stage];
      solution.cost = Cost(solution.joints);
      double damping = 0;
      for (int i = 0; i < patience_ * kMostIterations[stage] && !stop.stop_requested(); ++i) {
        ++solution.iterations;
        const double before = solution.cost;
        Linearise(solution.joints);
        for (int refused = 0; refused < kMostRefusals && systems_ < patience_ * kMostSystems[stage];
             ++refused) {
          if (StepFrom(solution.joints, damping)) {
            for (int k = 0; k < frames_; ++k) {
              trial.row(k) = solution.joints.row(k) + step_.segment(k * n_, n_).transpose();
            }
            Clamp(trial);
            const double cost = Cost(trial);
            if (cost < solution.cost) {
              solution.cost = cost;
              solution.joints.swap(trial);
              damping = damping > 1e-6 ? damping * 0.1 : 0;
              break;
            }
            if (before - cost > -1e-9 * before) break;  // nothing is left to gain
          }
          damping = std::max(damping * 30, 1e-6);
        }
        if (before - solution.cost <= settled_ * kSettled[stage] * before) break;
      }
    }
    MeasureErrors(chain_, problem_, solution);
    return solution;
  }

 private:
  /// Of each run of frames without a cut, the weighted square of this combination of neighbours'
  /// distances to the style.
  void AddDifferences(std::initializer_list<double> coefficients, double weight) {
    const double* c = coefficients.begin();
    const int count = static_cast<int>(coefficients.size());
    for (int k = 0; k + count <= frames_; ++k) {
      const auto cut = std::upper_bound(guess_.cuts.begin(), guess_.cuts.end(), k);
      if (cut != guess_.cuts.end() && *cut < k + count) continue;
      for (int a = 0; a < count; ++a) {
        for (int b = a; b < count; ++b) smooth_(k + a, b - a) += weight * c[a] * c[b];
      }
    }
  }

  void Clamp(Eigen::MatrixXd& joints) const {
    for (int j = 0; j < n_; ++j) {
      joints.col(j) = joints.col(j).cwiseMax(bounds_.lower[j]).cwiseMin(bounds_.upper[j]);
    }
  }

  double PositionWeight(int frame) const {
    const Tracking& tracking = problem_.tracking(static_cast<std::size_t>(frame));
    return 1 / Square(std::max(tracking.position_deviation_m, easing_));
  }
  double RotationWeight(int frame) const {
    if (!problem_.use_rotation) return 0;
    const Tracking& tracking = problem_.tracking(static_cast<std::size_t>(frame));
    return 1 / Square(std::max(tracking.rotation_deviation_rad, easing_));
  }

  /// The matrix of all terms on differences times the distances to the style, into row k of one
  /// joint: half its gradient.
  Eigen::RowVectorXd SmoothRow(const Eigen::MatrixXd& away, int k) const {
    Eigen::RowVectorXd row = smooth_(k, 0) * away.row(k);
    for (int d = 1; d < 4; ++d) {
      if (k + d < frames_) row += smooth_(k, d) * away.row(k + d);
      if (k >= d) row += smooth_(k - d, d) * away.row(k - d);
    }
    return row;
  }

  double Cost(const Eigen::MatrixXd& joints) {
    double cost = 0;
    for (int k = 0; k < frames_; ++k) {
      q_ = joints.row(k).transpose();
      const Vector6 error = PoseError(problem_, k, chain_.ToolPose(q_));
      cost += PositionWeight(k) * error.head<3>().squaredNorm() +
              RotationWeight(k) * error.tail<3>().squaredNorm();
    }
    if (problem_.first.size() == n_) {
      cost += (joints.row(0).transpose() - problem_.first).squaredNorm() / Square(kFirst_rad);
    }
    away_ = joints - style_;
    for (int j = 0; j < n_; ++j) cost += style_weight_[j] * away_.col(j).squaredNorm();
    for (int k = 0; k < frames_; ++k) cost += away_.row(k).dot(SmoothRow(away_, k));
    return cost;
  }

  /// Half the gradient, and the undamped normal matrix.
  void Linearise(const Eigen::MatrixXd& joints) {
    normal_.SetZero();
    away_ = joints - style_;
    for (int k = 0; k < frames_; ++k) {
      q_ = joints.row(k).transpose();
      const geometry::Pose at = chain_.ToolPoseAndJacobian(q_, jacobian_);
      const Vector6 error = PoseError(problem_, k, at);
      const double position = PositionWeight(k);
      const double rotation = RotationWeight(k);
      weighted_ = jacobian_;
      weighted_.topRows<3>() *= position;
      weighted_.bottomRows<3>() *= rotation;
      const int row = k * n_;
      gradient_.segment(row, n_) = SmoothRow(away_, k).transpose();
      for (int a = 0; a < n_; ++a) {
        const Vector6 column = weighted_.col(a);
        gradient_[row + a] += style_weight_[a] * away_(k, a) - column.dot(error);
        for (int b = 0; b <= a; ++b) {
          normal_(row + a, row + b) = column.dot(jacobian_.col(b));
        }
        normal_(row + a, row + a) += style_weight_[a] + smooth_(k, 0);
        for (int d = 1; d < 4 && k + d < frames_; ++d) {
          normal_(row + a + d * n_, row + a) = smooth_(k, d);
        }
      }
    }
    if (problem_.first.size() == n_) {
      for (int j = 0; j < n_; ++j) {
        gradient_[j] += (joints(0, j) - problem_.first[j]) / Square(kFirst_rad);
        normal_(j, j) += 1 / Square(kFirst_rad);
      }
    }
  }

  /// Row i of the damped matrix times step_.
  double RowTimesStep(int i, double damping) const {
    const int band = normal_.half_band();
    double sum = normal_(i, i) * (1 + damping) * step_[i];
    for (int other = std::max(0, i - band); other < i; ++other) {
      sum += normal_(i, other) * step_[other];
    }
    for (int other = i + 1; other <= std::min(normal_.size() - 1, i + band); ++other) {
      sum += normal_(other, i) * step_[other];
    }
    return sum;
  }

  /// Holds variable i at `value` in factor_ and takes its part to the right side.
  void Hold(int i, double value) {
    const int band = factor_.half_band();
    for (int other = std::max(0, i - band); other < i; ++other) {
      step_[other] -= factor_(i, other) * value;
      factor_(i, other) = 0;
    }
    for (int other = i + 1; other <= std::min(factor_.size() - 1, i + band); ++other) {
      step_[other] -= factor_(other, i) * value;
      factor_(other, i) = 0;
    }
    factor_(i, i) = 1;
  }

  /// The damped step, joints that it would take across a bound held there; false when the system
  /// cannot be solved.
  bool StepFrom(const Eigen::MatrixXd& joints, double damping) {
    const int size = frames_ * n_;
    const auto room = [&](int i, int side) {
      const int j = i % n_;
      return (side < 0 ? bounds_.lower[j] : bounds_.upper[j]) - joints(i / n_, j);
    };
    for (int round = 0; round < kActiveSetRounds; ++round) {
      factor_ = normal_;
      step_ = -gradient_;
      for (int i = 0; i < size; ++i) factor_(i, i) *= 1 + damping;
      for (int i = 0; i < size; ++i) {
        if (held_[static_cast<std::size_t>(i)] != 0) {
          Hold(i, room(i, held_[static_cast<std::size_t>(i)]));
        }
      }
      for (int i = 0; i < size; ++i) {
        const int side = held_[static_cast<std::size_t>(i)];
        if (side != 0) step_[i] = room(i, side);
      }
      ++systems_;
      if (!factor_.Factorise()) return false;
      factor_.Solve(step_);
      if (!step_.allFinite()) return false;
      bool changed = false;
      for (int i = 0; i < size; ++i) {
        signed char& side = held_[static_cast<std::size_t>(i)];
        if (side == 0) {
          if (step_[i] < room(i, -1) - 1e-12) side = -1;
          if (step_[i] > room(i, 1) + 1e-12) side = 1;
          changed = changed || side != 0;
        } else if (side * (gradient_[i] + RowTimesStep(i, damping)) > 0) {
          side = 0;  // pulled away from its bound
          changed = true;
        }
      }
      if (!changed) break;
    }
    return true;
  }

  const kinematics::Chain& chain_;
  const PathProblem& problem_;
  const Branch& guess_;
  int frames_;
  int n_;
  JointBounds bounds_;
  BandedMatrix normal_, factor_;
  Eigen::VectorXd gradient_;
  Eigen::VectorXd step_;
  std::vector<signed char> held_;  ///< -1: at the lower bound, 1: at the upper one
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian_, weighted_;
  Eigen::VectorXd q_;
  Eigen::MatrixXd style_, away_;
  Eigen::MatrixXd smooth_;  ///< frames x 4: entries (k, k) to (k, k + 3) of the differences' matrix
  Eigen::ArrayXd style_weight_;
  double easing_ = 0;
  int systems_ = 0;
  int patience_ = 1;
  double settled_ = 1;
};

}  // namespace

JointBounds PathBounds(const kinematics::Chain& chain) {
  JointBounds bounds{Eigen::VectorXd(chain.dof()), Eigen::VectorXd(chain.dof())};
  for (int j = 0; j < chain.dof(); ++j) {
    const kinematics::JointLimits& limits = chain.limits()[static_cast<std::size_t>(j)];
    const double margin = std::min(kLimitMargin, 0.25 * (limits.upper - limits.lower));
    bounds.lower[j] = limits.lower + margin;
    bounds.upper[j] = limits.upper - margin;
  }
  return bounds;
}

PathSolution RefinePath(const kinematics::Chain& chain, const PathProblem& problem,
                        const Branch& guess, PathIkVariant variant, std::stop_token stop) {
  return Refiner(chain, problem, guess, variant).Solve(std::move(stop));
}

}  // namespace exemplar::motion
