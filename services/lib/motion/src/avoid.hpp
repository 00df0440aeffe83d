#pragma once
// Away from obstacles, as far as the tool's path leaves the joints free.

#include <optional>
#include <vector>

#include "exemplar/collision/scene.hpp"
#include "exemplar/motion/path_ik.hpp"

namespace exemplar::motion {

/// Who may touch what at a frame (N of them, or none).
using FrameTouches = std::vector<std::vector<collision::AllowedTouch>>;

/// The same problem with a style that leads the joints away from what comes nearer to them than
/// `margin_m`, by motions that leave the tool where it is; the farther from such frames, the more
/// the old style counts. Nothing where all keeps the margin, or where the tool's path leaves no
/// freedom. `joints` (N x n): the answer so far.
std::optional<PathProblem> AwayFromObstacles(const kinematics::RobotModel& model,
                                             const kinematics::Chain& chain,
                                             const collision::CollisionChecker& checker,
                                             const PathProblem& problem,
                                             const Eigen::MatrixXd& joints,
                                             const FrameTouches& touches, double margin_m);

}  // namespace exemplar::motion
