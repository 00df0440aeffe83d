#pragma once
// Away from what the robot touches where it stands, as after a stop in the middle of a press.

#include <vector>

#include "exemplar/motion/plan.hpp"

namespace exemplar::motion {

struct Departure {
  JointTrajectory trajectory;        ///< from rest to rest; empty where nothing is touched
  std::vector<TouchWindow> touches;  ///< what is touched, until it is as far away as asked for
  PlanReport report = {};  ///< its smallest clearance, what is touched left out until then
};

/// A straight way of the tool out of the touch in which the robot stands. Only `touch_links` may be
/// nearer than the clearance asked for, and only to things of the scene. Proved without gaps: what
/// is touched never comes nearer than it was before, by more than 0.5 mm, and once it is as far
/// away as asked for it stays so; everything else is at least so far away all along.
/// kFailedPrecondition says what is touched that must not be, or what is in the way.
Result<Departure> PlanDeparture(const kinematics::RobotModel& model, const kinematics::Chain& chain,
                                const collision::CollisionChecker& checker,
                                const Eigen::Ref<const Eigen::VectorXd>& start,
                                const PlanOptions& options);

/// The departure first, then `plan`, which begins where that ends.
void Prepend(const Departure& departure, PlannedMotion& plan);

}  // namespace exemplar::motion
