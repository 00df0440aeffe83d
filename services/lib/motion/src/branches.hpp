#pragma once
// Ways of standing from which a path can be followed: starting points for SolvePath.

#include <Eigen/Core>
#include <vector>

#include "path_ik.hpp"

namespace exemplar::motion {

struct Branch {
  Eigen::MatrixXd joints;  ///< N x n, a first guess of the whole path
  int frames_missed = 0;   ///< where the guess could not follow
  double score = 0;        ///< smaller is better
};

/// Solves the first frame from several seeds, follows each distinct answer along the path frame by
/// frame, and returns them best first: few frames missed, then near the style, near `start`,
/// without jumps. Never empty. Deterministic.
std::vector<Branch> FindBranches(const kinematics::Chain& chain, const PathProblem& problem,
                                 const Eigen::Ref<const Eigen::VectorXd>& start);

}  // namespace exemplar::motion
