#pragma once
// Inverse kinematics of a whole path at once. Pure functions, thread-safe.

#include <Eigen/Core>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/geometry/pose.hpp"
#include "exemplar/kinematics/chain.hpp"
#include "exemplar/kinematics/inertia.hpp"

namespace exemplar::motion {

/// How redundant joints are made to follow a tool path.
enum class PathIkVariant {
  /// Ours: the whole path at once, near the demonstrated joints, smooth in jerk, within limits, on
  /// the branch of postures on which all of it can be followed.
  kExemplar,
  /// The paper's: each frame by itself, from the demonstrated joints by pseudo-inverse steps of
  /// bounded length. Knows no limits.
  kPlain,
  /// Each frame from the one before by the steps of least kinetic energy, the pseudo-inverse
  /// weighted by the inertia matrix (Whitney 1969). Knows no limits.
  kEnergy,
  /// The whole path at once with the least sum of squared joint steps, within limits.
  kPath,
};
std::string_view ToString(PathIkVariant variant);
/// kInvalidArgument offers the names that there are: "exemplar", "plain", "energy", "path".
Result<PathIkVariant> ParsePathIkVariant(std::string_view name);

/// Of one kind of frame: what error is ordinary (the smaller, the harder it pulls), and up to
/// which error a frame counts as met.
struct Tracking {
  double position_deviation_m = 1e-3;
  double rotation_deviation_rad = 4e-3;
  double position_tolerance_m = 5e-3;
  double rotation_tolerance_rad = 2e-2;
};

/// What the joints have to do: N frames, at least two, of n joints.
struct PathProblem {
  std::vector<double> time_s;
  std::vector<geometry::Pose> base_T_tool;
  bool use_rotation = true;
  std::vector<bool> exact;  ///< a frame in contact
  Tracking contact = {1e-5, 2e-3, 1e-4, 2e-2};
  Tracking free = {};
  Eigen::MatrixXd style;                ///< N x n: where the joints would like to be
  Eigen::VectorXd style_deviation_rad;  ///< n: how far from there is ordinary
  /// Of the terms on differences over time, 1: ordinary. Less lets quick paths be followed.
  double smoothness = 1;
  /// The first frame is drawn to this posture; empty: it is free.
  Eigen::VectorXd first = {};

  const Tracking& tracking(std::size_t frame) const { return exact[frame] ? contact : free; }
};

/// A joint of a frame that moves further than this from the frame before is reported.
inline constexpr double kLargeJointStep_rad = 0.2;

struct PathSolution {
  Eigen::MatrixXd joints;  ///< N x n; within limits, but for kPlain and kEnergy
  /// N: what is left of the way to the asked pose. Nothing is snapped: a frame out of reach keeps
  /// the posture that comes as near as the whole path allows, and says so here.
  Eigen::VectorXd position_error_m, rotation_error_rad;
  std::vector<int> missed;       ///< frames out of tolerance
  std::vector<int> large_steps;  ///< frames k with a step of over kLargeJointStep_rad from k - 1
  double cost = 0;
  int iterations = 0;
  int guesses = 1;  ///< branches that were refined
};

/// The whole path from where it is asked for to the joints. `start` (n): where the robot is, one of
/// the postures from which the search begins. `inertia` is needed by kEnergy alone.
///
/// kExemplar: Gauss-Newton over all frames together (see RefinePath), first from the style followed
/// along the path; where frames stay out of tolerance or joints jump, a search over branches
/// follows (see FindBranches) and the better answer is taken: fewer frames missed, then fewer large
/// steps, then the lower cost. Deterministic.
Result<PathSolution> SolvePath(const kinematics::Chain& chain, const PathProblem& problem,
                               const Eigen::Ref<const Eigen::VectorXd>& start,
                               PathIkVariant variant = PathIkVariant::kExemplar,
                               const kinematics::ChainInertia* inertia = nullptr,
                               std::stop_token stop = {});

/// A way of standing along the whole path: a first guess.
struct Branch {
  Eigen::MatrixXd joints;  ///< N x n
  std::vector<int> cuts;   ///< frames before which the guess jumps, ascending
  int frames_missed = 0;   ///< about: where the guess could not follow
  double score = 0;        ///< smaller is better
};

/// Solves some frames from many seeds, follows each distinct answer along the path both ways until
/// it comes to a dead end, and finds the best way through this graph by dynamic programming: few
/// frames missed, then few jumps, then near the style. That way comes first; the answers that are
/// whole from the first frame on follow, best first. Never empty. Deterministic.
/// `hard_frame`: one that gave trouble, to be solved too; -1: none.
std::vector<Branch> FindBranches(const kinematics::Chain& chain, const PathProblem& problem,
                                 const Eigen::Ref<const Eigen::VectorXd>& start,
                                 int hard_frame = -1);

/// Sum of squares of tracking error, distance to the style, and the first and third differences of
/// that distance over time, minimised by Gauss-Newton with Levenberg's damping over all frames
/// together, tracking eased at first and tightened in steps. Limits are active bounds (primal-dual
/// active set, Hintermueller et al. 2003): a joint that a step would take across its limit stays on
/// it and the others make up for it. The normal equations have a half band of 4 n - 1.
PathSolution RefinePath(const kinematics::Chain& chain, const PathProblem& problem,
                        const Branch& guess, PathIkVariant variant = PathIkVariant::kExemplar,
                        std::stop_token stop = {});

/// The limits that path inverse kinematics keeps to: those of the chain less a hair, so that
/// splines between frames stay inside too.
struct JointBounds {
  Eigen::VectorXd lower, upper;
};
JointBounds PathBounds(const kinematics::Chain& chain);

}  // namespace exemplar::motion
