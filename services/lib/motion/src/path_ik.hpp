#pragma once
// Inverse kinematics of a whole path at once.

#include <Eigen/Core>
#include <stop_token>
#include <vector>

#include "exemplar/geometry/pose.hpp"
#include "exemplar/kinematics/chain.hpp"

namespace exemplar::motion {

/// What the joints have to do, N frames of n joints.
struct PathProblem {
  std::vector<double> time_s;
  std::vector<geometry::Pose> base_T_tool;
  bool use_rotation = true;
  std::vector<bool> exact;              ///< a frame in contact
  Eigen::MatrixXd style;                ///< N x n: where the joints would like to be
  Eigen::VectorXd style_deviation_rad;  ///< n: how far from there is ordinary
  /// Of the terms on differences over time, 1: ordinary. Less lets quick paths be followed.
  double smoothness = 1;
  /// The first frame is drawn to this posture; empty: it is free.
  Eigen::VectorXd first = {};
};

struct PathSolution {
  Eigen::MatrixXd joints;  ///< N x n, within limits
  double cost = 0;
  int iterations = 0;
};

/// Sum of squares of tracking (about 1 mm is ordinary, 0.01 mm in contact), distance to the style,
/// and the first and second differences of that distance over time, minimised by Gauss-Newton with
/// Levenberg's damping over all frames together. Limits are active bounds (projected Newton,
/// Bertsekas 1982): a joint that a step would take across its limit stays on it and the others make
/// up for it. The normal equations have a half band of 3 n - 1. `initial`: N x n.
PathSolution SolvePath(const kinematics::Chain& chain, const PathProblem& problem,
                       const Eigen::Ref<const Eigen::MatrixXd>& initial, std::stop_token stop);

/// The limits that SolvePath keeps to: those of the chain less a hair, so that splines between
/// frames stay inside too.
struct JointBounds {
  Eigen::VectorXd lower, upper;
};
JointBounds PathBounds(const kinematics::Chain& chain);

}  // namespace exemplar::motion
