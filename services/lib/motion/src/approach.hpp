#pragma once
// From where the robot stands to a motion's first frame.

#include <vector>

#include "exemplar/collision/scene.hpp"
#include "exemplar/motion/plan.hpp"

namespace exemplar::motion {

/// A collision-free way from rest to rest in joint space: straight, else over one or two raised
/// postures. What `ignored` allows is never looked at. Empty when `start` is `goal`.
/// kFailedPrecondition says what is in the way.
Result<JointTrajectory> PlanApproach(const kinematics::RobotModel& model,
                                     const kinematics::Chain& chain,
                                     const collision::CollisionChecker& checker,
                                     const Eigen::Ref<const Eigen::VectorXd>& start,
                                     const Eigen::Ref<const Eigen::VectorXd>& goal,
                                     const std::vector<collision::AllowedTouch>& ignored,
                                     const PlanOptions& options);

}  // namespace exemplar::motion
