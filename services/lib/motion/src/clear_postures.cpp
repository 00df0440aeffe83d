#include "clear_postures.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "exemplar/base/rng.hpp"
#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::motion {
namespace {

constexpr int kSeeds = 60;
constexpr double kSamePosture_rad = 0.25;

}  // namespace

std::vector<Eigen::VectorXd> ClearPostures(const kinematics::RobotModel& model,
                                           const kinematics::Chain& chain,
                                           const collision::CollisionChecker& checker,
                                           const PathProblem& problem, int frame,
                                           const std::vector<collision::AllowedTouch>& allowed,
                                           double clearance_m, std::size_t most) {
  const auto at = static_cast<std::size_t>(frame);
  const JointBounds bounds = PathBounds(chain);
  const Eigen::VectorXd style = problem.style.row(frame).transpose();
  kinematics::IkOptions options;
  options.position_tolerance_m = problem.tracking(at).position_tolerance_m;
  options.rotation_tolerance_rad = problem.tracking(at).rotation_tolerance_rad;
  options.use_rotation = problem.use_rotation;
  options.max_restarts = 0;
  options.max_iterations = 60;
  Rng rng(static_cast<std::uint64_t>(frame) + 1);
  std::vector<std::pair<double, Eigen::VectorXd>> found;  ///< by their distance to the style
  for (int i = 0; i < kSeeds; ++i) {
    Eigen::VectorXd seed(chain.dof());
    for (int j = 0; j < chain.dof(); ++j) {
      seed[j] = rng.Uniform(std::isfinite(bounds.lower[j]) ? bounds.lower[j] : -M_PI,
                            std::isfinite(bounds.upper[j]) ? bounds.upper[j] : M_PI);
    }
    Result<kinematics::IkSolution> solution =
        kinematics::SolveIk(chain, problem.base_T_tool[at], seed, options);
    if (!solution.ok()) continue;
    const Eigen::VectorXd full = kinematics::FullJointVector(model, chain, solution->q);
    if (checker.SmallestClearance(full, allowed).distance_m < clearance_m) continue;
    found.emplace_back((solution->q - style).norm(), std::move(solution->q));
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Eigen::VectorXd> postures;
  for (auto& [distance, posture] : found) {
    if (postures.size() == most) break;
    const bool known =
        std::any_of(postures.begin(), postures.end(), [&q = posture](const Eigen::VectorXd& other) {
          return (other - q).cwiseAbs().maxCoeff() < kSamePosture_rad;
        });
    if (!known) postures.push_back(std::move(posture));
  }
  return postures;
}

}  // namespace exemplar::motion
