#include "path_ik.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "banded.hpp"

namespace exemplar::motion {
namespace {

// Ordinary deviations; each term is divided by its own.
constexpr double kFreePosition_m = 1e-3;
constexpr double kFreeRotation_rad = 4e-3;
constexpr double kContactPosition_m = 1e-5;
constexpr double kContactRotation_rad = 2e-3;
constexpr double kFirst_rad = 2e-3;
constexpr double kVelocity_rad_per_s = 1.5;
constexpr double kAcceleration_rad_per_s2 = 15;

constexpr int kMaxIterations = 60;
constexpr double kLimitMargin = 2e-3;  // rad or m

using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

double Square(double x) { return x * x; }

class Solver {
 public:
  Solver(const kinematics::Chain& chain, const PathProblem& problem)
      : chain_(chain),
        problem_(problem),
        frames_(static_cast<int>(problem.base_T_tool.size())),
        n_(chain.dof()),
        bounds_(PathBounds(chain)),
        normal_(frames_ * n_, 3 * n_ - 1),
        gradient_(frames_ * n_),
        step_(frames_ * n_),
        jacobian_(6, n_) {
    const double interval = frames_ > 1 ? problem.time_s.back() / (frames_ - 1) : 1.0;
    velocity_weight_ = problem.smoothness / Square(kVelocity_rad_per_s * interval);
    acceleration_weight_ =
        problem.smoothness / Square(kAcceleration_rad_per_s2 * interval * interval);
    style_weight_ = problem.style_deviation_rad.array().square().inverse();
  }

  PathSolution Solve(const Eigen::Ref<const Eigen::MatrixXd>& initial, std::stop_token stop) {
    PathSolution solution;
    solution.joints = initial;
    Clamp(solution.joints);
    solution.cost = Cost(solution.joints);
    double damping = 1e-6;
    Eigen::MatrixXd trial(frames_, n_);
    for (; solution.iterations < kMaxIterations && !stop.stop_requested(); ++solution.iterations) {
      Linearise(solution.joints);
      double decrease = 0;
      while (damping < 1e8) {
        if (StepFrom(solution.joints, damping)) {
          for (int k = 0; k < frames_; ++k) {
            trial.row(k) = solution.joints.row(k) + step_.segment(k * n_, n_).transpose();
          }
          Clamp(trial);
          const double cost = Cost(trial);
          if (cost < solution.cost) {
            decrease = solution.cost - cost;
            solution.cost = cost;
            solution.joints.swap(trial);
            damping = std::max(damping * 0.2, 1e-9);
            break;
          }
        }
        damping *= 10;
      }
      if (decrease <= 1e-7 * solution.cost) break;
    }
    return solution;
  }

 private:
  void Clamp(Eigen::MatrixXd& joints) const {
    for (int j = 0; j < n_; ++j) {
      joints.col(j) = joints.col(j).cwiseMax(bounds_.lower[j]).cwiseMin(bounds_.upper[j]);
    }
  }

  double PositionWeight(int frame) const {
    return 1 / Square(problem_.exact[frame] ? kContactPosition_m : kFreePosition_m);
  }
  double RotationWeight(int frame) const {
    if (!problem_.use_rotation) return 0;
    return 1 / Square(problem_.exact[frame] ? kContactRotation_rad : kFreeRotation_rad);
  }

  Eigen::Matrix<double, 6, 1> Error(int frame, const geometry::Pose& at) const {
    const geometry::Pose& goal = problem_.base_T_tool[frame];
    Eigen::Matrix<double, 6, 1> error;
    error.head<3>() = goal.translation - at.translation;
    if (problem_.use_rotation) {
      error.tail<3>() = geometry::LogSo3(goal.rotation * at.rotation.conjugate());
    } else {
      error.tail<3>().setZero();
    }
    return error;
  }

  double Cost(const Eigen::MatrixXd& joints) const {
    double cost = 0;
    Eigen::VectorXd q(n_);
    for (int k = 0; k < frames_; ++k) {
      q = joints.row(k).transpose();
      const Eigen::Matrix<double, 6, 1> error = Error(k, chain_.ToolPose(q));
      cost += PositionWeight(k) * error.head<3>().squaredNorm() +
              RotationWeight(k) * error.tail<3>().squaredNorm();
    }
    if (problem_.first.size() == n_) {
      cost += (joints.row(0).transpose() - problem_.first).squaredNorm() / Square(kFirst_rad);
    }
    const Eigen::MatrixXd deviation = joints - problem_.style;
    for (int j = 0; j < n_; ++j) cost += style_weight_[j] * deviation.col(j).squaredNorm();
    for (int k = 0; k + 1 < frames_; ++k) {
      cost += velocity_weight_ * (deviation.row(k + 1) - deviation.row(k)).squaredNorm();
    }
    for (int k = 1; k + 1 < frames_; ++k) {
      cost += acceleration_weight_ *
              (deviation.row(k - 1) - 2 * deviation.row(k) + deviation.row(k + 1)).squaredNorm();
    }
    return cost;
  }

  /// Half the gradient, and the undamped normal matrix.
  void Linearise(const Eigen::MatrixXd& joints) {
    normal_.SetZero();
    gradient_.setZero();
    Eigen::VectorXd q(n_);
    for (int k = 0; k < frames_; ++k) {
      q = joints.row(k).transpose();
      const geometry::Pose at = chain_.ToolPoseAndJacobian(q, jacobian_);
      const Eigen::Matrix<double, 6, 1> error = Error(k, at);
      const double position = PositionWeight(k);
      const double rotation = RotationWeight(k);
      const int row = k * n_;
      for (int a = 0; a < n_; ++a) {
        gradient_[row + a] -= position * jacobian_.col(a).head<3>().dot(error.head<3>()) +
                              rotation * jacobian_.col(a).tail<3>().dot(error.tail<3>());
        for (int b = 0; b <= a; ++b) {
          normal_(row + a, row + b) +=
              position * jacobian_.col(a).head<3>().dot(jacobian_.col(b).head<3>()) +
              rotation * jacobian_.col(a).tail<3>().dot(jacobian_.col(b).tail<3>());
        }
      }
    }
    if (problem_.first.size() == n_) {
      for (int j = 0; j < n_; ++j) {
        AddTerm(1 / Square(kFirst_rad), joints(0, j) - problem_.first[j], {j}, {1.0});
      }
    }
    for (int j = 0; j < n_; ++j) {
      const auto d = [&](int k) { return joints(k, j) - problem_.style(k, j); };
      const auto at = [&](int k) { return k * n_ + j; };
      for (int k = 0; k < frames_; ++k) AddTerm(style_weight_[j], d(k), {at(k)}, {1.0});
      for (int k = 0; k + 1 < frames_; ++k) {
        AddTerm(velocity_weight_, d(k + 1) - d(k), {at(k), at(k + 1)}, {-1.0, 1.0});
      }
      for (int k = 1; k + 1 < frames_; ++k) {
        AddTerm(acceleration_weight_, d(k - 1) - 2 * d(k) + d(k + 1), {at(k - 1), at(k), at(k + 1)},
                {1.0, -2.0, 1.0});
      }
    }
  }

  /// A residual that is linear in a few variables (ascending).
  void AddTerm(double weight, double residual, std::initializer_list<int> variables,
               std::initializer_list<double> coefficients) {
    const int* v = variables.begin();
    const double* c = coefficients.begin();
    for (std::size_t a = 0; a < variables.size(); ++a) {
      gradient_[v[a]] += weight * c[a] * residual;
      for (std::size_t b = 0; b <= a; ++b) normal_(v[a], v[b]) += weight * c[a] * c[b];
    }
  }

  /// The damped step with the active bounds held; false when the system cannot be solved.
  bool StepFrom(const Eigen::MatrixXd& joints, double damping) {
    BandedMatrix damped = normal_;
    step_ = -gradient_;
    const int size = frames_ * n_;
    const int band = 3 * n_ - 1;
    for (int i = 0; i < size; ++i) damped(i, i) *= 1 + damping;
    for (int i = 0; i < size; ++i) {
      const int joint = i % n_;
      const double q = joints(i / n_, joint);
      const bool active = (q <= bounds_.lower[joint] && gradient_[i] > 0) ||
                          (q >= bounds_.upper[joint] && gradient_[i] < 0);
      if (!active) continue;
      for (int other = std::max(0, i - band); other < i; ++other) damped(i, other) = 0;
      for (int other = i + 1; other <= std::min(size - 1, i + band); ++other) damped(other, i) = 0;
      damped(i, i) = 1;
      step_[i] = 0;
    }
    if (!damped.Factorise()) return false;
    damped.Solve(step_);
    return step_.allFinite();
  }

  const kinematics::Chain& chain_;
  const PathProblem& problem_;
  int frames_;
  int n_;
  JointBounds bounds_;
  BandedMatrix normal_;
  Eigen::VectorXd gradient_;
  Eigen::VectorXd step_;
  Jacobian jacobian_;
  double velocity_weight_ = 0;
  double acceleration_weight_ = 0;
  Eigen::ArrayXd style_weight_;
};

}  // namespace

JointBounds PathBounds(const kinematics::Chain& chain) {
  JointBounds bounds{Eigen::VectorXd(chain.dof()), Eigen::VectorXd(chain.dof())};
  for (int j = 0; j < chain.dof(); ++j) {
    const kinematics::JointLimits& limits = chain.limits()[j];
    const double margin = std::min(kLimitMargin, 0.25 * (limits.upper - limits.lower));
    bounds.lower[j] = limits.lower + margin;
    bounds.upper[j] = limits.upper - margin;
  }
  return bounds;
}

PathSolution SolvePath(const kinematics::Chain& chain, const PathProblem& problem,
                       const Eigen::Ref<const Eigen::MatrixXd>& initial, std::stop_token stop) {
  return Solver(chain, problem).Solve(initial, std::move(stop));
}

}  // namespace exemplar::motion
