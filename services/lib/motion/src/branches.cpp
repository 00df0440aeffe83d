#include "branches.hpp"

#include <algorithm>
#include <cmath>

#include "exemplar/base/rng.hpp"
#include "exemplar/kinematics/inverse_kinematics.hpp"

namespace exemplar::motion {
namespace {

constexpr int kRandomSeeds = 8;
constexpr double kSamePosture_rad = 0.05;
/// A guess is followed at so many frames; those between are interpolated.
constexpr int kFollowedFrames = 80;
constexpr double kPositionTolerance_m = 1e-4;
constexpr double kRotationTolerance_rad = 1e-3;

kinematics::IkOptions GuessOptions(const PathProblem& problem, int frame) {
  kinematics::IkOptions options;
  options.position_tolerance_m = kPositionTolerance_m;
  options.rotation_tolerance_rad = kRotationTolerance_rad;
  options.use_rotation = problem.use_rotation;
  options.preferred = problem.style.row(frame).transpose();
  options.max_restarts = 0;
  options.max_iterations = 60;
  return options;
}

std::vector<Eigen::VectorXd> FirstPostures(const kinematics::Chain& chain,
                                           const PathProblem& problem,
                                           const Eigen::Ref<const Eigen::VectorXd>& start) {
  const JointBounds bounds = PathBounds(chain);
  std::vector<Eigen::VectorXd> seeds = {start, problem.style.row(0).transpose()};
  if (problem.first.size() == chain.dof()) seeds.insert(seeds.begin(), problem.first);
  Rng rng(1);
  for (int i = 0; i < kRandomSeeds; ++i) {
    Eigen::VectorXd seed(chain.dof());
    for (int j = 0; j < chain.dof(); ++j) {
      const double lower = std::isfinite(bounds.lower[j]) ? bounds.lower[j] : -M_PI;
      const double upper = std::isfinite(bounds.upper[j]) ? bounds.upper[j] : M_PI;
      seed[j] = rng.Uniform(lower, upper);
    }
    seeds.push_back(seed);
  }
  std::vector<Eigen::VectorXd> postures;
  for (const Eigen::VectorXd& seed : seeds) {
    // Without the pull of the style first, which would lead all seeds to the same posture.
    kinematics::IkOptions options = GuessOptions(problem, 0);
    options.preferred.resize(0);
    const Result<kinematics::IkSolution> found =
        kinematics::SolveIk(chain, problem.base_T_tool.front(), seed, options);
    if (!found.ok()) continue;
    const bool known = std::any_of(postures.begin(), postures.end(), [&](const auto& posture) {
      return (posture - found->q).cwiseAbs().maxCoeff() < kSamePosture_rad;
    });
    if (!known) postures.push_back(found->q);
  }
  // Unreachable from everywhere: the path solver then says how far it stays away.
  if (postures.empty()) postures.emplace_back(problem.style.row(0).transpose());
  return postures;
}

Branch Follow(const kinematics::Chain& chain, const PathProblem& problem,
              const Eigen::VectorXd& first) {
  const int frames = static_cast<int>(problem.base_T_tool.size());
  const int stride = std::max(1, frames / kFollowedFrames);
  Branch branch;
  branch.joints.resize(frames, chain.dof());
  branch.joints.row(0) = first.transpose();
  Eigen::VectorXd q = first;
  int before = 0;
  for (int k = 0; k < frames;) {
    const Result<kinematics::IkSolution> found =
        kinematics::SolveIk(chain, problem.base_T_tool[k], q, GuessOptions(problem, k));
    if (found.ok()) {
      // A jump to another branch is as bad as a miss: the guess stays with the one it is on.
      const double jump = (found->q - q).cwiseAbs().maxCoeff();
      if (k == 0 || jump < 0.15 * stride + 0.3) {
        q = found->q;
      } else {
        ++branch.frames_missed;
      }
    } else {
      ++branch.frames_missed;
    }
    const Eigen::RowVectorXd from = branch.joints.row(before);
    for (int i = before; i <= k; ++i) {
      const double part = k == before ? 1.0 : static_cast<double>(i - before) / (k - before);
      branch.joints.row(i) = from + part * (q.transpose() - from);
    }
    before = k;
    if (k == frames - 1) break;
    k = std::min(frames - 1, k + stride);
  }
  return branch;
}

}  // namespace

std::vector<Branch> FindBranches(const kinematics::Chain& chain, const PathProblem& problem,
                                 const Eigen::Ref<const Eigen::VectorXd>& start) {
  std::vector<Branch> branches;
  for (const Eigen::VectorXd& first : FirstPostures(chain, problem, start)) {
    Branch branch = Follow(chain, problem, first);
    const Eigen::MatrixXd deviation = branch.joints - problem.style;
    const Eigen::ArrayXd weight = problem.style_deviation_rad.array().square().inverse();
    double style = 0;
    for (int j = 0; j < chain.dof(); ++j) {
      style += weight[j] * deviation.col(j).squaredNorm() / static_cast<double>(deviation.rows());
    }
    const double way = (branch.joints.row(0).transpose() - start).squaredNorm();
    branch.score = 100.0 * branch.frames_missed + style + way;
    branches.push_back(std::move(branch));
  }
  std::stable_sort(branches.begin(), branches.end(),
                   [](const Branch& a, const Branch& b) { return a.score < b.score; });
  return branches;
}

}  // namespace exemplar::motion
