#pragma once
// From a request to a checked motion: asks the skill, places what is seen, plans.

#include <functional>
#include <limits>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "executor/guard.hpp"
#include "executor/robot_view.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/motion/departure.hpp"
#include "exemplar/motion/plan.hpp"
#include "exemplar/scene/description.hpp"

namespace exemplar::executor {

struct PlannerOptions {
  /// Older joint states count as none.
  Duration state_patience = std::chrono::milliseconds(250);
  /// Objects seen longer ago are not used unless they are asked for with their pose.
  Duration object_patience = std::chrono::seconds(2);
  /// The motion begins at the last commanded posture where the robot is this near to it, else at
  /// the measured one; and is refused where it has moved further than this while it was planned.
  double start_tolerance_rad = 0.05;
  motion::PlanOptions plan = {};
  GuardOptions guard = {};
  /// An object that is seen further than this from where it was taken to be has moved.
  double moved_m = 0.005;
  double moved_rad = 0.05;
};

struct Planned {
  motion::PlannedMotion motion;
  collision::CollisionChecker checker;
  std::vector<geometry::NamedPose> objects;  ///< what the skill was asked for
  std::vector<geometry::NamedPose> placed;   ///< where everything was taken to be, those last
  std::vector<GuardZone> zones;
  std::vector<motion::Carry> carries;  ///< what the hand takes on the way
  std::vector<std::string> warnings;
  int frames = 0;
  bool guarded = false;  ///< its presses, or those with the target that is chased, end by touch
};

/// Of a plan that follows a moving target.
struct Chase {
  std::string target = {};
  /// Changes what the skill answered before it is planned; `guarded`: its first press of the target
  /// goes on until touch. Other presses end by position.
  std::function<void(demonstration::SkillMotion& motion, bool guarded)> adjust;
  std::optional<Eigen::VectorXd> start;  ///< from where; else as ever
  std::optional<bool> guarded = {};      ///< so and not otherwise; absent: where there is room
  double guard_longest_s = std::numeric_limits<double>::infinity();  ///< as GuardOptions
};

api::PlanSummary Summarise(const Planned& planned);

/// Thread-safe.
class Planner {
 public:
  /// The arguments by reference outlive the planner.
  Planner(const Clock& clock, api::SkillApi& skills, const kinematics::RobotDescription& robot,
          const scene::Description& scene, const RobotView& view, PlannerOptions options);

  /// `last_command`: where the robot was told to be, where it was told anything. Where it stands in
  /// a touch it backs off first, and the skill is asked for the motion from there.
  Result<Planned> Plan(const api::ExecuteRequest& request,
                       const std::optional<Eigen::VectorXd>& last_command, std::stop_token stop,
                       const Chase* chase = nullptr) const;

  const PlannerOptions& options() const { return options_; }
  const scene::Description& scene() const { return scene_; }
  /// What the skill is about. Errors as the skill service's.
  Result<std::string> TargetOf(const api::ExecuteRequest& request) const;

  /// Refuses a motion whose first point the robot is not near, or of which nobody knows.
  Status CheckStart(const motion::PlannedMotion& plan) const;

  /// The scene as it is seen now, with what is carried, where something but `fixed` moved away from
  /// `placed`, which is brought up to date.
  std::optional<collision::Scene> MovedScene(const std::vector<geometry::NamedPose>& fixed,
                                             const std::vector<motion::Carry>& carries,
                                             std::vector<geometry::NamedPose>& placed) const;

 private:
  /// The last usable joint state, if it is fresh.
  Result<MeasuredState> FreshState() const;
  /// Guarded where there is a press, a touch sensor and room for it.
  Result<Planned> PlanGuarded(const demonstration::SkillMotion& motion,
                              collision::CollisionChecker checker, const MeasuredState& measured,
                              const Eigen::VectorXd& start, const motion::Departure& departure,
                              double speed, const Chase* chase, const std::stop_token& stop) const;
  /// What the motion carries, whose bodies the checker gets to know.
  Status TakeCarries(const demonstration::SkillMotion& motion, const Chase* chase,
                     collision::CollisionChecker& checker,
                     std::vector<motion::Carry>& carries) const;
  std::optional<demonstration::SkillMotion> Guarded(const demonstration::SkillMotion& motion,
                                                    const Chase* chase) const;
  Result<std::vector<geometry::NamedPose>> ObjectsFor(const api::ExecuteRequest& request) const;

  const Clock& clock_;
  api::SkillApi& skills_;
  const kinematics::RobotDescription& robot_;
  const scene::Description& scene_;
  const RobotView& view_;
  const PlannerOptions options_;
};

}  // namespace exemplar::executor
