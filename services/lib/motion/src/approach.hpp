#pragma once
// From where the robot stands to a motion's first frame.

#include <vector>

#include "exemplar/collision/scene.hpp"
#include "exemplar/motion/plan.hpp"

namespace exemplar::motion {

struct Approach {
  JointTrajectory trajectory;
  double rise_s = 0;  ///< so long `touches` are in use, from the beginning
};

/// A collision-free way from rest to rest in joint space: straight, else over one or two raised
/// postures. Where the robot begins in a touch of `touches` (the last press), it first rises from
/// it. What `ignored` allows is never looked at. Empty when `start` is `goal`. kFailedPrecondition
/// says what is in the way.
Result<Approach> PlanApproach(const kinematics::RobotModel& model, const kinematics::Chain& chain,
                              const collision::CollisionChecker& checker,
                              const Eigen::Ref<const Eigen::VectorXd>& start,
                              const Eigen::Ref<const Eigen::VectorXd>& goal,
                              std::vector<collision::AllowedTouch> touches,
                              const std::vector<collision::AllowedTouch>& ignored,
                              const PlanOptions& options);

}  // namespace exemplar::motion
