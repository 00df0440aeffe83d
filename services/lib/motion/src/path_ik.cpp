#include "exemplar/motion/path_ik.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "path_errors.hpp"
#include "path_variants.hpp"

namespace exemplar::motion {
namespace {

constexpr std::array<std::pair<PathIkVariant, std::string_view>, 4> kNames = {
    {{PathIkVariant::kExemplar, "exemplar"},
     {PathIkVariant::kPlain, "plain"},
     {PathIkVariant::kEnergy, "energy"},
     {PathIkVariant::kPath, "path"}}};

/// Of the frame that is missed most, before a path counts as out of reach.
constexpr int kMendRestarts = 30;

bool IsBetter(const PathSolution& a, const PathSolution& b) {
  if (a.missed.size() != b.missed.size()) return a.missed.size() < b.missed.size();
  if (a.large_steps.size() != b.large_steps.size()) {
    return a.large_steps.size() < b.large_steps.size();
  }
  return a.cost < b.cost;
}

bool IsRight(const PathSolution& solution) {
  return solution.missed.empty() && solution.large_steps.empty();
}

int WorstFrame(const PathSolution& solution) {
  if (solution.missed.empty()) {
    return solution.large_steps.empty() ? -1 : solution.large_steps.front();
  }
  return *std::max_element(solution.missed.begin(), solution.missed.end(), [&](int a, int b) {
    return solution.position_error_m[a] + solution.rotation_error_rad[a] <
           solution.position_error_m[b] + solution.rotation_error_rad[b];
  });
}

/// The posture that meets a frame by itself, from a neighbour's; nothing when it is out of reach.
std::optional<Eigen::VectorXd> MeetFrame(const kinematics::Chain& chain, const PathProblem& problem,
                                         int frame, const Eigen::VectorXd& seed) {
  const Tracking& tracking = problem.tracking(static_cast<std::size_t>(frame));
  kinematics::IkOptions options;
  options.position_tolerance_m = 0.5 * tracking.position_tolerance_m;
  options.rotation_tolerance_rad = 0.5 * tracking.rotation_tolerance_rad;
  options.use_rotation = problem.use_rotation;
  options.max_restarts = kMendRestarts;
  const Result<kinematics::IkSolution> found = kinematics::SolveIk(
      chain, problem.base_T_tool[static_cast<std::size_t>(frame)], seed, options);
  if (!found.ok()) return std::nullopt;
  return found->q;
}

/// Frames that the whole path could not meet, each by itself: where one can be met after all, a
/// jump to it is reported like any other.
void MendFrames(const kinematics::Chain& chain, const PathProblem& problem,
                PathSolution& solution) {
  if (solution.missed.empty()) return;
  for (const int k : solution.missed) {
    const Eigen::VectorXd seed = solution.joints.row(std::max(0, k - 1)).transpose();
    const std::optional<Eigen::VectorXd> found = MeetFrame(chain, problem, k, seed);
    if (!found) break;  // out of reach, and its neighbours with it
    solution.joints.row(k) = found->transpose();
  }
  MeasureErrors(chain, problem, solution);
}

/// From the style itself, and where that is not right, from the best way through all branches.
PathSolution SolveWhole(const kinematics::Chain& chain, const PathProblem& problem,
                        const Eigen::Ref<const Eigen::VectorXd>& start, PathIkVariant variant,
                        const std::stop_token& stop) {
  PathSolution best = RefinePath(chain, problem, {problem.style, {}, 0, 0}, variant, stop);
  if (IsRight(best) || stop.stop_requested()) return best;
  const int worst = WorstFrame(best);
  if (!best.missed.empty() &&
      !MeetFrame(chain, problem, worst, best.joints.row(worst).transpose())) {
    return best;  // no branch can meet it
  }
  const std::vector<Branch> branches = FindBranches(chain, problem, start, worst);
  PathSolution other = RefinePath(chain, problem, branches.front(), variant, stop);
  if (IsBetter(other, best)) best = std::move(other);
  best.guesses = 2;
  MendFrames(chain, problem, best);
  return best;
}

}  // namespace

std::string_view ToString(PathIkVariant variant) {
  for (const auto& [value, name] : kNames) {
    if (value == variant) return name;
  }
  return "unknown";
}

Result<PathIkVariant> ParsePathIkVariant(std::string_view name) {
  for (const auto& [value, known] : kNames) {
    if (known == name) return value;
  }
  return InvalidArgument("there is no inverse kinematics \"" + std::string(name) +
                             "\"; known are exemplar, plain, energy, path",
                         "inverse_kinematics");
}

Result<PathSolution> SolvePath(const kinematics::Chain& chain, const PathProblem& problem,
                               const Eigen::Ref<const Eigen::VectorXd>& start,
                               PathIkVariant variant, const kinematics::ChainInertia* inertia,
                               std::stop_token stop) {
  PathSolution solution;
  switch (variant) {
    case PathIkVariant::kExemplar:
    case PathIkVariant::kPath:
      return SolveWhole(chain, problem, start, variant, stop);
    case PathIkVariant::kPlain:
      solution.joints = PlainJoints(chain, problem);
      break;
    case PathIkVariant::kEnergy:
      if (inertia == nullptr) {
        return InvalidArgument("inverse kinematics of least energy needs the robot's masses",
                               "inverse_kinematics");
      }
      solution.joints = LeastEnergyJoints(chain, problem, *inertia);
      break;
  }
  MeasureErrors(chain, problem, solution);
  return solution;
}

}  // namespace exemplar::motion
