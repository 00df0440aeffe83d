#include "approach.hpp"

#include <optional>
#include <string>
#include <vector>

#include "describe.hpp"
#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "timing.hpp"
#include "trajectory.hpp"

namespace exemplar::motion {
namespace {

constexpr double kThere_rad = 1e-6;
constexpr double kLifts_m[] = {0.08, 0.16, 0.28};

using Way = std::vector<Eigen::VectorXd>;  ///< postures with rest at each

/// The posture with the tool `lift_m` higher, near `q`.
std::optional<Eigen::VectorXd> Raised(const kinematics::Chain& chain,
                                      const Eigen::Ref<const Eigen::VectorXd>& q, double lift_m) {
  geometry::Pose base_T_tool = chain.ToolPose(q);
  base_T_tool.translation.z() += lift_m;
  kinematics::IkOptions options;
  options.position_tolerance_m = 1e-3;
  options.rotation_tolerance_rad = 1e-2;
  options.max_restarts = 0;
  Result<kinematics::IkSolution> found = kinematics::SolveIk(chain, base_T_tool, q, options);
  if (!found.ok()) {
    options.use_rotation = false;
    found = kinematics::SolveIk(chain, base_T_tool, q, options);
  }
  if (!found.ok()) return std::nullopt;
  return found->q;
}

}  // namespace

Result<JointTrajectory> PlanApproach(const kinematics::RobotModel& model,
                                     const kinematics::Chain& chain,
                                     const collision::CollisionChecker& checker,
                                     const Eigen::Ref<const Eigen::VectorXd>& start,
                                     const Eigen::Ref<const Eigen::VectorXd>& goal,
                                     const std::vector<collision::AllowedTouch>& ignored,
                                     const PlanOptions& options) {
  if ((start - goal).cwiseAbs().maxCoeff() < kThere_rad) return JointTrajectory{};
  const auto time = [&](const Way& way) {
    JointTrajectory all;
    for (std::size_t i = 0; i + 1 < way.size(); ++i) {
      all = Concatenate(all, TimeLine(way[i], way[i + 1], chain.joint_names(), chain.limits(),
                                      options.approach_velocity));
    }
    return all;
  };
  const auto first_violation = [&](const JointTrajectory& trajectory) {
    const TrajectoryPath path(trajectory, model, chain);
    return checker.FirstViolation(path, 0, trajectory.duration_s(), options.required_clearance_m,
                                  ignored);
  };
  JointTrajectory straight = time({start, goal});
  const std::optional<collision::Violation> in_the_way = first_violation(straight);
  if (!in_the_way) return straight;

  std::vector<Way> ways;
  for (const double lift : kLifts_m) {
    const std::optional<Eigen::VectorXd> above_start = Raised(chain, start, lift);
    const std::optional<Eigen::VectorXd> above_goal = Raised(chain, goal, lift);
    if (above_goal) ways.push_back({start, *above_goal, goal});
    if (above_start) ways.push_back({start, *above_start, goal});
    if (above_start && above_goal) ways.push_back({start, *above_start, *above_goal, goal});
    if (options.comfortable.size() == chain.dof()) {
      if (above_start && above_goal) {
        ways.push_back({start, *above_start, options.comfortable, *above_goal, goal});
      }
    }
  }
  for (const Way& way : ways) {
    JointTrajectory trajectory = time(way);
    if (!first_violation(trajectory)) return trajectory;
  }
  return FailedPrecondition(
      "no free way from where the robot stands to the motion's first frame; "
      "on the straight one, " +
      DescribeViolation(*in_the_way, options.required_clearance_m) +
      "; over raised postures it is no better");
}

}  // namespace exemplar::motion
