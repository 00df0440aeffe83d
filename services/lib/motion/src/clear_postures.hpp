#pragma once
// Other ways of standing, for where the usual one is in its own way.

#include <Eigen/Core>
#include <vector>

#include "exemplar/collision/scene.hpp"
#include "exemplar/motion/path_ik.hpp"

namespace exemplar::motion {

/// Postures that reach the path's pose at `frame` and keep `clearance_m` there, but for the touches
/// in `allowed`: found from many seeds without any pull, distinct, at most `most`, those nearest to
/// the style first. Deterministic.
std::vector<Eigen::VectorXd> ClearPostures(const kinematics::RobotModel& model,
                                           const kinematics::Chain& chain,
                                           const collision::CollisionChecker& checker,
                                           const PathProblem& problem, int frame,
                                           const std::vector<collision::AllowedTouch>& allowed,
                                           double clearance_m, std::size_t most);

}  // namespace exemplar::motion
