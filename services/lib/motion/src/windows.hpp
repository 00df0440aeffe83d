#pragma once
// When who may touch what in a planned motion.

#include <vector>

#include "exemplar/motion/plan.hpp"

namespace exemplar::motion {

/// What is carried may touch what it stood on, or is laid on, so near to there.
inline constexpr double kLiftedMargin_m = 0.03;

/// A stretch of a trajectory with its own permissions.
struct Stretch {
  double begin_s = 0;
  double end_s = 0;
  std::vector<collision::AllowedTouch> allowed;
};

/// Adds contacts and touches of the motion, whose frames are reached at `offset_s` and so much.
void AddContacts(const demonstration::SkillMotion& motion, const kinematics::Chain& chain,
                 const PlanOptions& options, const std::vector<double>& frame_time_s,
                 double offset_s, PlannedMotion& plan);
/// Likewise what is carried.
void AddCarryWindows(const demonstration::SkillMotion& motion, const kinematics::Chain& chain,
                     const PlanOptions& options, const std::vector<double>& frame_time_s,
                     double offset_s, PlannedMotion& plan);

/// What does not count before anything was taken.
std::vector<collision::AllowedTouch> NotYet(const std::vector<Carry>& carries);

std::vector<Stretch> MakeStretches(const PlannedMotion& plan,
                                   const std::vector<std::string>& touch_links);

/// The smallest clearance at the trajectory's frames, into the report.
void MeasureClearance(const JointTrajectory& trajectory, const kinematics::RobotModel& model,
                      const kinematics::Chain& chain, const collision::CollisionChecker& checker,
                      const std::vector<Stretch>& stretches, PlanReport& report);

}  // namespace exemplar::motion
