#pragma once
// Random paths like a skill's answers: joints move smoothly from posture to posture, and their tool
// path is bent towards an object, so that the joints no longer lead along it.

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "exemplar/base/rng.hpp"
#include "exemplar/motion/path_ik.hpp"

namespace exemplar::bench {

enum class PathKind { kEasy, kNearSingular, kEdge, kBeyond };
inline constexpr std::array<const char*, 4> kPathKindNames = {"easy", "near_singular", "edge",
                                                              "beyond"};

struct BlendedPath {
  PathKind kind = PathKind::kEasy;
  motion::PathProblem problem;
  int contact_first = 0;  ///< from here on the path is wholly the object's
};

class BlendedPaths {
 public:
  static constexpr int kFrames = 300;
  static constexpr double kRate_hz = 60;

  BlendedPaths(const kinematics::Chain& chain, std::uint64_t seed)
      : chain_(chain), rng_(seed), middle_(chain.dof()), half_(chain.dof()) {
    for (int j = 0; j < chain.dof(); ++j) {
      const kinematics::JointLimits& limits = chain.limits()[static_cast<std::size_t>(j)];
      const bool endless = !std::isfinite(limits.lower);
      middle_[j] = endless ? 0.0 : 0.5 * (limits.lower + limits.upper);
      half_[j] = endless ? std::numbers::pi : 0.5 * (limits.upper - limits.lower);
    }
  }

  BlendedPath Make(PathKind kind) {
    BlendedPath out;
    out.kind = kind;
    const bool far = kind == PathKind::kEdge || kind == PathKind::kBeyond;
    const Eigen::VectorXd centre = far                               ? Farthest()
                                   : kind == PathKind::kNearSingular ? LeastAble()
                                                                     : Random(0.35);
    // From one side of the centre to the other.
    const std::array<Eigen::VectorXd, 3> via = {Near(centre), centre, Near(centre)};
    motion::PathProblem& problem = out.problem;
    problem.style.resize(kFrames, chain_.dof());
    for (int k = 0; k < kFrames; ++k) {
      const double r = 2.0 * k / (kFrames - 1);
      const Eigen::VectorXd a = Blend(r) * (via[1] - via[0]);
      const Eigen::VectorXd b = Blend(r - 1) * (via[2] - via[1]);
      problem.style.row(k) = (via[0] + a + b).transpose();
    }
    Eigen::Vector3d shift = Direction() * rng_.Uniform(0.02, far ? 0.04 : 0.08);
    const Eigen::Vector3d turn = Direction() * rng_.Uniform(0.02, far ? 0.1 : 0.2);
    if (kind == PathKind::kBeyond) {
      shift = chain_.ToolPose(via[1]).translation.normalized() * rng_.Uniform(0.1, 0.3);
    }
    for (int k = 0; k < kFrames; ++k) {
      const double blend = Blend((k - 0.3 * kFrames) / (0.4 * kFrames));
      geometry::Pose pose = chain_.ToolPose(problem.style.row(k).transpose());
      pose.translation += blend * shift;
      pose.rotation = (geometry::ExpSo3(blend * turn) * pose.rotation).normalized();
      problem.time_s.push_back(k / kRate_hz);
      problem.base_T_tool.push_back(pose);
    }
    out.contact_first = static_cast<int>(0.7 * kFrames) + 1;
    problem.exact.assign(kFrames, true);
    problem.contact = {1e-5, 1e-5, 0.9e-4, 0.9e-4};
    problem.style_deviation_rad = Eigen::VectorXd::Constant(chain_.dof(), 0.2);
    return out;
  }

  Eigen::VectorXd Random(double share) {
    Eigen::VectorXd q(chain_.dof());
    for (int j = 0; j < chain_.dof(); ++j) {
      q[j] = middle_[j] + rng_.Uniform(-share, share) * half_[j];
    }
    return q;
  }

 private:
  static double Blend(double r) {
    r = std::clamp(r, 0.0, 1.0);
    return r * r * r * (10 - 15 * r + 6 * r * r);
  }

  Eigen::Vector3d Direction() {
    return Eigen::Vector3d(rng_.Normal(), rng_.Normal(), rng_.Normal()).normalized();
  }

  Eigen::VectorXd Near(const Eigen::VectorXd& centre) {
    Eigen::VectorXd q = centre;
    for (int j = 0; j < chain_.dof(); ++j) {
      q[j] += rng_.Uniform(-1.0, 1.0) * std::min(0.5, 0.35 * half_[j]);
      q[j] = std::clamp(q[j], middle_[j] - 0.95 * half_[j], middle_[j] + 0.95 * half_[j]);
    }
    return q;
  }

  /// The best of some random postures by `score`.
  template <class Score>
  Eigen::VectorXd Best(Score&& score) {
    Eigen::VectorXd best = Random(0.8);
    double highest = score(best);
    for (int i = 0; i < 100; ++i) {
      const Eigen::VectorXd q = Random(0.8);
      const double value = score(q);
      if (value <= highest) continue;
      highest = value;
      best = q;
    }
    return best;
  }

  Eigen::VectorXd Farthest() {
    return Best([&](const Eigen::VectorXd& q) { return chain_.ToolPose(q).translation.norm(); });
  }

  Eigen::VectorXd LeastAble() {
    Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, chain_.dof());
    return Best([&](const Eigen::VectorXd& q) {
      chain_.ToolPoseAndJacobian(q, jacobian);
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(jacobian);
      return -svd.singularValues().minCoeff();
    });
  }

  const kinematics::Chain& chain_;
  Rng rng_;
  Eigen::VectorXd middle_, half_;
};

}  // namespace exemplar::bench
