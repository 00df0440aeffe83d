#include <algorithm>
#include <cmath>

#include "executor/following.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/ircp/simulated_time.hpp"

namespace exemplar::executor {
namespace {

/// What planning and checking take, before the motion may begin: at least, and of what they took.
constexpr double kLead_s = 0.4;
constexpr double kLeadShare = 1.5;
/// Guessed before the first plan says better.
constexpr double kGuess_s = 3;
/// A target may turn back no nearer to the touch.
constexpr double kCalmBefore_s = 0.5;
constexpr double kCalmAfter_s = 0.2;
/// A faster target is pressed by position, which clicked 20 of 20 times at 0.2 m/s; by touch 17.
constexpr double kTouchUpTo_m_s = 0.12;
/// A press that ends by touch is over so long after its deepest place.
constexpr double kPressOver_s = 0.25;
constexpr double kWaitStep_s = 0.1;
constexpr int kRounds = 6;
/// The way of the tool before a contact by which its direction is told, and so much deeper it goes.
constexpr double kApproach_m = 0.015;
constexpr double kDeeper_m = 0.0015;
/// Where a press ends by touch the tool goes back out by so much, and the button's travel besides.
constexpr double kLift_m = 0.006;
/// Between two looks at a target whose way is not known yet.
constexpr Duration kLook = std::chrono::milliseconds(50);

/// Pushes the tool further in along its way to the target, most in the middle of the contact: a
/// moving target is not met as closely as one that stands.
void PushDeeper(const demonstration::Contact& contact, demonstration::SkillMotion& motion) {
  const auto tool = [&](int frame) -> Eigen::Vector3d& {
    return motion.base_T_tool[static_cast<std::size_t>(frame)].translation;
  };
  int before = contact.first;
  while (before > 0 && (tool(before) - tool(contact.first)).norm() < kApproach_m) --before;
  const Eigen::Vector3d way = tool(contact.first) - tool(before);
  if (way.norm() < 0.5 * kApproach_m || contact.last <= contact.first) return;
  const Eigen::Vector3d inward = way.normalized();
  for (int k = contact.first; k <= contact.last; ++k) {
    const double s =
        static_cast<double>(k - contact.first) / static_cast<double>(contact.last - contact.first);
    // Rises over the first third and falls over the last, at rest at both ends.
    const double up = std::clamp(3 * std::min(s, 1 - s), 0.0, 1.0);
    tool(k) += kDeeper_m * up * up * up * (10 - 15 * up + 6 * up * up) * inward;
  }
}

/// Where the press is deepest first.
std::size_t DeepestFrame(const demonstration::SkillMotion& motion,
                         const demonstration::Contact& contact, const Eigen::Vector3d& inward) {
  const auto deeper = [&](const geometry::Pose& a, const geometry::Pose& b) {
    return inward.dot(a.translation) < inward.dot(b.translation);
  };
  const auto begin = motion.base_T_tool.begin();
  const auto deepest = std::max_element(begin + contact.first, begin + contact.last + 1, deeper);
  return static_cast<std::size_t>(deepest - begin);
}

}  // namespace

Result<std::pair<TargetTrack, geometry::Pose>> FollowingPlanner::Seen(
    const std::string& target) const {
  auto seen = tracks_.Find(target);
  const Duration now = clock_.Steady();
  if (!seen || now - seen->first.last_seen() > options_.lost_patience) {
    return FailedPrecondition(
        "target \"" + target + "\" cannot be followed: " +
            (seen
                 ? "it was seen last " + FormatFixed(ToSeconds(now - seen->first.last_seen()), 2) +
                       " s ago, " + FormatFixed(ToSeconds(options_.lost_patience), 2) + " s allowed"
                 : std::string("it was never seen on ircp/objects")),
        "objects");
  }
  if (seen->first.speed() > options_.fastest_m_s) {
    return FailedPrecondition("target \"" + target + "\" moves at " +
                                  FormatFixed(seen->first.speed(), 3) + " m/s, at most " +
                                  FormatFixed(options_.fastest_m_s, 3) + " can be followed",
                              "objects");
  }
  return *seen;
}

Result<FollowingPlan> FollowingPlanner::PlanFor(
    const api::ExecuteRequest& request, const std::string& target, const TargetTrack& track,
    const geometry::Pose& seen, Duration contact, const std::vector<double>& frame_time_s,
    const std::optional<Eigen::VectorXd>& from, std::optional<bool> guarded,
    const std::optional<Eigen::VectorXd>& last_command, const std::stop_token& stop) const {
  const Eigen::Vector3d at_contact = track.PositionAt(contact);
  api::ExecuteRequest placed = request;
  placed.objects = {{target, {at_contact, seen.rotation}, true}};
  std::optional<Error> unfit;
  std::optional<Eigen::Vector3d> inward;
  std::size_t deepest = 0;  // frame
  Chase chase;
  chase.target = target;
  chase.start = from;
  chase.guarded = guarded;
  if (!guarded && track.speed() > kTouchUpTo_m_s) chase.guarded = false;
  if (track.speed() > 0) chase.guard_longest_s = options_.longest_press_s;
  chase.adjust = [&](demonstration::SkillMotion& motion, bool until_touch) {
    const auto met =
        std::find_if(motion.contacts.begin(), motion.contacts.end(),
                     [&](const demonstration::Contact& c) { return c.object == target; });
    if (met == motion.contacts.end() || motion.base_T_tool.empty()) {
      unfit = FailedPrecondition("the skill's motion does not touch \"" + target +
                                 "\" with the tool: there is nothing to follow it for");
      return;
    }
    const std::vector<double>& time =
        static_cast<int>(frame_time_s.size()) == motion.frames() ? frame_time_s : motion.time_s;
    const auto at = [&](int frame) { return time[static_cast<std::size_t>(frame)]; };
    const TargetTimes times{at(met->first), at(met->last)};
    if (until_touch) {
      inward = PressDirection(motion, *met);
      deepest = inward ? DeepestFrame(motion, *met, *inward) : 0;
    } else if (track.speed() > 0) {
      PushDeeper(*met, motion);
    }
    for (int k = 0; k < motion.frames(); ++k) {
      const Duration when = contact + FromSeconds(at(k) - times.contact_s);
      motion.base_T_tool[static_cast<std::size_t>(k)].translation +=
          times.ShareAt(at(k)) * (track.PositionAt(when) - at_contact);
    }
  };
  Result<Planned> planned = planner_.Plan(placed, last_command, stop, &chase);
  if (unfit) return *unfit;
  if (!planned.ok()) return planned.error();
  FollowingPlan plan{*std::move(planned), Duration(0), target, {}, {}, 0, {}, {}, {}};
  for (const motion::ContactWindow& window : plan.planned.motion.contacts) {
    if (window.object != target) continue;
    plan.times = {window.begin_s, window.end_s};
    plan.object_p_contact = window.base_p_contact - at_contact;
    break;
  }
  plan.over_s = plan.times.release_s;
  if (plan.planned.guarded && inward) {
    plan.over_s = plan.planned.motion.frame_time_s[deepest] + kPressOver_s;
    const GuardOptions guard = GuardFor(target, planner_.scene(), planner_.options().guard);
    const double travel_m = guard.distance_m - planner_.options().guard.distance_m;
    plan.press = TargetPress{*inward, plan.object_p_contact, -guard.distance_m, kLift_m + travel_m};
  }
  plan.start = contact - FromSeconds(plan.times.contact_s);
  return plan;
}

Result<FollowingPlan> FollowingPlanner::Plan(const api::ExecuteRequest& request,
                                             const std::optional<Eigen::VectorXd>& last_command,
                                             const std::stop_token& stop) const {
  Result<std::string> target = planner_.TargetOf(request);
  if (!target.ok()) return target.error();
  const Duration watched_until = clock_.Steady() + FromSeconds(options_.longest_watch_s);
  for (auto seen = Seen(*target); seen.ok() && seen->first.turning_points() == 1;
       seen = Seen(*target)) {
    if (clock_.Steady() >= watched_until) break;
    if (!clock_.SleepFor(kLook, stop))
      return Error{ErrorCode::kCancelled, "planning was cancelled"};
  }
  double contact_s = kGuess_s;
  double over_s = kGuess_s + 1;
  double lead_s = kLead_s;
  std::optional<bool> guarded;
  std::vector<double> frame_time_s;
  for (int round = 0;; ++round) {
    const auto seen = Seen(*target);
    if (!seen.ok()) return seen.error();
    const TargetTrack& track = seen->first;
    const Duration begun = clock_.Steady();
    const Duration earliest = begun + FromSeconds(lead_s + contact_s);
    Duration contact = earliest;
    double wait_s = 0;
    const auto turns = [&] {
      return track.TurnsWithin(contact - FromSeconds(kCalmBefore_s),
                               contact + FromSeconds(over_s - contact_s + kCalmAfter_s));
    };
    for (; turns() && wait_s < options_.longest_wait_s; wait_s += kWaitStep_s) {
      contact = earliest + FromSeconds(wait_s);
    }
    if (turns()) {
      return FailedPrecondition("target \"" + *target +
                                "\" turns back too often: the touch takes " +
                                FormatFixed(over_s - contact_s, 1) + " s");
    }
    // Where time is simulated it stands meanwhile, as in all calls.
    const ircp::TimeHold hold(clock_);
    Result<FollowingPlan> plan = PlanFor(request, *target, track, seen->second, contact,
                                         frame_time_s, std::nullopt, guarded, last_command, stop);
    if (!plan.ok()) return plan.error();
    const bool timed =
        std::abs(plan->times.contact_s - contact_s) < 0.05 || track.speed() == 0 || round > 1;
    contact_s = plan->times.contact_s;
    over_s = plan->over_s;
    frame_time_s = plan->planned.motion.frame_time_s;
    if (track.speed() == 0) plan->start = clock_.Steady();
    const auto late = [&] { return track.speed() > 0 && clock_.Steady() > plan->start; };
    bool usable = timed && !late();
    if (usable && !Complete(track, *plan)) {
      guarded = false;
      usable = false;
    }
    lead_s = std::max(lead_s, kLeadShare * ToSeconds(clock_.Steady() - begun));
    if (!usable || late()) {
      if (round + 1 < kRounds) continue;
      return Unavailable("target \"" + *target + "\" cannot be followed: planning takes too long");
    }
    if (guarded) {
      plan->planned.warnings.push_back(
          "pressed by position, not until touch: no room is proved for lifting off on a touch");
    }
    const Eigen::VectorXd levers = plan->planned.checker.LongestLevers();
    plan->lever_m.resize(robot_.chain.dof());
    for (int j = 0; j < robot_.chain.dof(); ++j) {
      plan->lever_m[j] = levers[robot_.chain.joint_indices()[j]];
    }
    return plan;
  }
}

bool FollowingPlanner::Complete(const TargetTrack& track, FollowingPlan& plan) const {
  // The target is not where the scene has it while the tool goes along with it.
  for (motion::TouchWindow& touch : plan.planned.motion.touches) {
    if (touch.object != plan.target || track.speed() == 0) continue;
    touch.begin_s = std::min(touch.begin_s, plan.times.begin_s());
    touch.end_s = std::max(touch.end_s, plan.times.end_s());
  }
  const TargetPress* press = plan.press ? &*plan.press : nullptr;
  plan.path = MakeFollowedPath(robot_.chain, plan.planned.motion.trajectory, plan.times, track,
                               plan.start, press);
  const bool proved = Prove(robot_, plan.planned.checker, plan.planned.motion,
                            required_clearance_m(), 0, plan.times, press, plan.path);
  if (press == nullptr) return true;
  const GuardOptions guard = GuardFor(plan.target, planner_.scene(), planner_.options().guard);
  std::optional<GuardZone> zone = ZoneOf(plan.path, *press, plan.times);
  if (!proved || !zone) return false;
  zone->object = plan.target;
  zone->touch_n = guard.touch_n;
  zone->distance_m = guard.distance_m;
  plan.planned.zones = {*std::move(zone)};
  return true;
}

Result<FollowingPlan> FollowingPlanner::Again(const api::ExecuteRequest& request,
                                              const std::string& target,
                                              const motion::PlannedMotion& first,
                                              const TargetTimes& times, bool guarded,
                                              Duration start, const std::stop_token& stop) const {
  const auto seen = Seen(target);
  if (!seen.ok()) return seen.error();
  const Duration contact = start + FromSeconds(times.contact_s);
  Result<FollowingPlan> plan = PlanFor(
      request, target, seen->first, seen->second, contact, first.frame_time_s,
      Eigen::VectorXd(first.trajectory.positions.row(0).transpose()), guarded, std::nullopt, stop);
  if (!plan.ok()) return plan;
  plan->path = MakeFollowedPath(robot_.chain, plan->planned.motion.trajectory, plan->times,
                                seen->first, plan->start, plan->press ? &*plan->press : nullptr);
  return plan;
}

}  // namespace exemplar::executor
