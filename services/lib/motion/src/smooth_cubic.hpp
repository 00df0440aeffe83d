#pragma once
// Cubic pieces from rest to rest whose acceleration does not jump: their jerk is finite.

#include "exemplar/motion/plan.hpp"

namespace exemplar::motion {

/// Gives `trajectory` the velocities with which its pieces join with continuous acceleration, and
/// velocity and acceleration are zero at both ends. The second and the last but one position give
/// way for that, to what the jerk of the first and last piece makes of them. Precondition: at least
/// five frames.
void JoinSmoothly(JointTrajectory& trajectory);

}  // namespace exemplar::motion
