#include "executor/planner.hpp"

#include <algorithm>
#include <utility>

#include "exemplar/base/text.hpp"

namespace exemplar::executor {

namespace {
/// A hand that opens and closes by more takes things.
constexpr double kGrasp = 0.2;
/// Fingers stand on both sides of what they take: they may touch it until they are past its height.
constexpr double kGraspMargin_m = 0.1;
}  // namespace

api::PlanSummary Summarise(const Planned& planned) {
  const motion::PlanReport& report = planned.motion.report;
  api::PlanSummary summary;
  summary.duration_s = planned.motion.trajectory.duration_s();
  summary.frames = planned.frames;
  summary.max_position_error_m = report.max_position_error_m;
  summary.max_contact_error_m = report.max_contact_error_m;
  summary.clearance_m = report.smallest_clearance.distance_m;
  if (!report.smallest_clearance.first.empty()) {
    summary.clearance_between =
        report.smallest_clearance.first + " and " + report.smallest_clearance.second;
  }
  summary.time_stretch = report.time_stretch;
  summary.warnings = planned.warnings;
  return summary;
}

Planner::Planner(const Clock& clock, api::SkillApi& skills,
                 const kinematics::RobotDescription& robot, const scene::Description& scene,
                 const RobotView& view, PlannerOptions options)
    : clock_(clock),
      skills_(skills),
      robot_(robot),
      scene_(scene),
      view_(view),
      options_(std::move(options)) {}

Result<MeasuredState> Planner::FreshState() const {
  const std::optional<MeasuredState> measured = view_.latest();
  const std::string problem = view_.problem();
  const std::string why = problem.empty() ? "" : ": " + problem;
  if (!measured) {
    return Unavailable("nothing usable was heard from the robot on ircp/joint_state" + why);
  }
  const Duration age = clock_.Steady() - measured->received;
  if (age > options_.state_patience) {
    return Unavailable("the robot's last usable joint state is " + FormatFixed(ToSeconds(age), 2) +
                       " s old, " + FormatFixed(ToSeconds(options_.state_patience), 2) +
                       " s allowed" + why);
  }
  return *measured;
}

Result<std::vector<geometry::NamedPose>> Planner::ObjectsFor(
    const api::ExecuteRequest& request) const {
  if (!request.objects.empty()) return request.objects;
  const Result<learning::SkillReport> skill = skills_.Show(request.skill, request.version);
  if (!skill.ok()) return skill.error();
  std::vector<geometry::NamedPose> objects;
  std::string seen_names;
  for (const api::SeenObject& seen : view_.objects(clock_.Steady())) {
    seen_names += (seen_names.empty() ? "" : ", ") + seen.pose.name + " (" +
                  FormatFixed(seen.age_s, 1) + " s ago)";
    if (seen.age_s > ToSeconds(options_.object_patience)) continue;
    const bool met = std::any_of(skill->contacts.begin(), skill->contacts.end(),
                                 [&](const auto& part) { return part.object == seen.pose.name; });
    if (!skill->target.empty() && seen.pose.name != skill->target && !met) continue;
    objects.push_back(seen.pose);
  }
  if (objects.empty()) {
    return FailedPrecondition("object \"" + skill->target +
                                  "\" was not seen on ircp/objects in the last " +
                                  FormatFixed(ToSeconds(options_.object_patience), 1) +
                                  " s; seen: " + (seen_names.empty() ? "nothing" : seen_names),
                              "objects");
  }
  return objects;
}

Result<std::string> Planner::TargetOf(const api::ExecuteRequest& request) const {
  const Result<learning::SkillReport> skill = skills_.Show(request.skill, request.version);
  if (!skill.ok()) return skill.error();
  return skill->target;
}

Result<Planned> Planner::Plan(const api::ExecuteRequest& request,
                              const std::optional<Eigen::VectorXd>& last_command,
                              std::stop_token stop, const Chase* chase) const {
  const Result<MeasuredState> measured = FreshState();
  if (!measured.ok()) return measured.error();
  Eigen::VectorXd start = measured->joints;
  if (last_command &&
      (*last_command - start).cwiseAbs().maxCoeff() <= options_.start_tolerance_rad) {
    start = *last_command;
  }
  if (chase != nullptr && chase->start) start = *chase->start;
  Result<std::vector<geometry::NamedPose>> objects = ObjectsFor(request);
  if (!objects.ok()) return objects.error();

  // What is seen stands where it is seen, but what was asked for stands where it was asked for.
  std::vector<geometry::NamedPose> seen;
  for (const api::SeenObject& object : view_.objects(clock_.Steady())) seen.push_back(object.pose);
  std::vector<geometry::NamedPose> placed = seen;
  placed.insert(placed.end(), objects->begin(), objects->end());
  Result<collision::CollisionChecker> checker = collision::CollisionChecker::Create(
      robot_.model, collision::MakeScene(scene_, placed), collision::OptionsOf(robot_));
  if (!checker.ok()) return checker.error();
  motion::PlanOptions options = options_.plan;
  options.speed_scale = request.speed;
  const Result<motion::Departure> departure =
      motion::PlanDeparture(robot_.model, robot_.chain, *checker, start, options);
  if (!departure.ok()) return departure.error();
  if (const auto frames = departure->trajectory.positions.rows(); frames > 0) {
    start = departure->trajectory.positions.row(frames - 1).transpose();
  }

  demonstration::SkillQuery query;
  query.objects = *objects;
  if (request.start) {
    query.start = request.start;
  } else {
    query.start = robot_.chain.ToolPose(start);
    query.joint_start_names = robot_.chain.joint_names();
    query.joint_start = start;
  }
  Result<demonstration::SkillMotion> motion = skills_.Query(request.skill, request.version, query);
  if (!motion.ok()) return motion.error();

  const std::vector<geometry::NamedPose>& used =
      motion->objects.empty() ? *objects : motion->objects;
  const bool turned_by_skill =
      !motion->objects.empty() &&
      std::any_of(objects->begin(), objects->end(),
                  [](const geometry::NamedPose& object) { return !object.has_orientation; });
  if (turned_by_skill) {
    placed = seen;
    placed.insert(placed.end(), used.begin(), used.end());
    const Status set = checker->SetScene(collision::MakeScene(scene_, placed));
    if (!set.ok()) return set.error();
  }
  Result<Planned> planned = PlanGuarded(*motion, *std::move(checker), *measured, start, *departure,
                                        request.speed, chase, stop);
  if (!planned.ok()) return planned;
  planned->objects = used;
  planned->placed = std::move(placed);
  return planned;
}

std::optional<demonstration::SkillMotion> Planner::Guarded(const demonstration::SkillMotion& motion,
                                                           const Chase* chase) const {
  if (chase == nullptr) return WithGuard(motion, scene_, options_.guard);
  GuardOptions options = options_.guard;
  options.longest_s = chase->guard_longest_s;
  for (std::size_t i = 0; i < motion.contacts.size(); ++i) {
    if (motion.contacts[i].object != chase->target) continue;
    return WithGuard(motion, scene_, options, i);
  }
  return std::nullopt;
}

Status Planner::TakeCarries(const demonstration::SkillMotion& motion, const Chase* chase,
                            collision::CollisionChecker& checker,
                            std::vector<motion::Carry>& carries) const {
  if (chase != nullptr) return {};  // what moves has no place that it is taken from
  std::vector<std::string> movable;
  for (const scene::Object& object : scene_.objects) {
    if (!object.fixed) movable.push_back(object.name);
  }
  auto found = motion::FindCarries(motion, checker.scene(), movable, robot_.chain.tip_link(),
                                   robot_.touch_links);
  if (!found.ok()) return found.error();
  carries = *std::move(found);
  collision::Scene scene = checker.scene();
  motion::AddCarries(carries, scene);
  return checker.SetScene(std::move(scene));
}

Result<Planned> Planner::PlanGuarded(const demonstration::SkillMotion& motion,
                                     collision::CollisionChecker checker,
                                     const MeasuredState& measured, const Eigen::VectorXd& start,
                                     const motion::Departure& departure, double speed,
                                     const Chase* chase, const std::stop_token& stop) const {
  motion::PlanOptions options = options_.plan;
  options.speed_scale = speed;
  const auto [closed, open] = std::minmax_element(motion.hand_open.begin(), motion.hand_open.end());
  const bool grasps = !motion.hand_open.empty() && *open - *closed > kGrasp;
  if (grasps) {
    options.touch_margin_m = std::max(options.touch_margin_m, kGraspMargin_m);
    if (const Status known = TakeCarries(motion, chase, checker, options.carries); !known.ok()) {
      return known.error();
    }
  }
  // What a hand goes to is taken, not pressed.
  const bool may_guard = !grasps && options_.guard.touch_n > 0 && measured.feels_touch &&
                         (chase == nullptr || chase->guarded.value_or(true));
  const auto plan = [&](const demonstration::SkillMotion& asked) {
    Result<motion::PlannedMotion> made =
        motion::PlanMotion(asked, robot_.model, robot_.chain, checker, start, options, stop);
    if (made.ok()) motion::Prepend(departure, *made);
    return made;
  };
  std::vector<std::string> warnings = motion.warnings;
  for (const motion::TouchWindow& touch : departure.touches) {
    warnings.push_back("the robot stands in touch with \"" + touch.object +
                       "\": it backs off from there first");
  }
  std::vector<GuardZone> zones;
  Result<motion::PlannedMotion> planned = FailedPrecondition("not planned");
  std::optional<demonstration::SkillMotion> guarded;
  if (may_guard) guarded = Guarded(motion, chase);
  if (guarded) {
    if (chase != nullptr) chase->adjust(*guarded, true);
    planned = plan(*guarded);
    if (planned.ok() && chase == nullptr) {
      zones = GuardZones(*planned, motion, robot_.chain, scene_, options_.guard);
    } else if (!planned.ok()) {
      warnings.push_back("pressed by position, not until touch: " + planned.error().message);
      guarded.reset();
    }
  }
  if (!guarded) {
    if (chase != nullptr && chase->guarded.value_or(false)) return planned.error();
    demonstration::SkillMotion by_position = motion;
    if (chase != nullptr) chase->adjust(by_position, false);
    planned = plan(by_position);
  }
  if (!planned.ok()) return planned.error();
  const std::vector<std::string>& more = planned->report.warnings;
  warnings.insert(warnings.end(), more.begin(), more.end());
  return Planned{*std::move(planned),
                 std::move(checker),
                 {},
                 {},
                 std::move(zones),
                 std::move(options.carries),
                 std::move(warnings),
                 motion.frames(),
                 guarded.has_value()};
}

std::optional<collision::Scene> Planner::MovedScene(
    const std::vector<geometry::NamedPose>& fixed, const std::vector<motion::Carry>& carries,
    std::vector<geometry::NamedPose>& placed) const {
  const auto named = [](const std::string& name) {
    return [&name](const geometry::NamedPose& pose) { return pose.name == name; };
  };
  bool moved = false;
  for (const api::SeenObject& seen : view_.objects(clock_.Steady())) {
    const geometry::NamedPose& now = seen.pose;
    if (std::any_of(fixed.begin(), fixed.end(), named(now.name))) continue;
    const auto before = std::find_if(placed.begin(), placed.end(), named(now.name));
    if (before == placed.end()) {
      placed.insert(placed.begin(), now);
      moved = true;
      continue;
    }
    const geometry::Pose& was = before->base_T_object;
    const double far = (now.base_T_object.translation - was.translation).norm();
    const double turned = geometry::AngleBetween(now.base_T_object.rotation, was.rotation);
    if (far <= options_.moved_m && !(now.has_orientation && turned > options_.moved_rad)) continue;
    *before = now;
    moved = true;
  }
  if (!moved) return std::nullopt;
  collision::Scene scene = collision::MakeScene(scene_, placed);
  motion::AddCarries(carries, scene);
  return scene;
}

Status Planner::CheckStart(const motion::PlannedMotion& plan) const {
  const Result<MeasuredState> measured = FreshState();
  if (!measured.ok()) return measured.error();
  const Eigen::VectorXd first = plan.trajectory.positions.row(0).transpose();
  int joint = 0;
  const double off = (measured->joints - first).cwiseAbs().maxCoeff(&joint);
  if (off <= options_.start_tolerance_rad) return {};
  return FailedPrecondition("the robot has moved since it was planned: joint \"" +
                            robot_.chain.joint_names()[joint] + "\" is " + FormatFixed(off, 3) +
                            " rad away from the motion's start");
}

}  // namespace exemplar::executor
