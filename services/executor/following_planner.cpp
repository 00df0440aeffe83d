#include <algorithm>
#include <cmath>

#include "executor/following.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::executor {
namespace {

/// What planning and checking take, before the motion may begin.
constexpr double kLead_s = 0.4;
/// Guessed before the first plan says better.
constexpr double kGuess_s = 3;
/// A target may turn back no nearer to the touch.
constexpr double kCalmBefore_s = 0.5;
constexpr double kCalmAfter_s = 0.2;
constexpr double kWaitStep_s = 0.1;
constexpr int kRounds = 5;
/// The way of the tool before a contact by which its direction is told, and so much deeper it goes.
constexpr double kApproach_m = 0.015;
constexpr double kDeeper_m = 0.0015;
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

Result<FollowingPlan> FollowingPlanner::PlanFor(const api::ExecuteRequest& request,
                                                const std::string& target, const TargetTrack& track,
                                                const geometry::Pose& seen, Duration contact,
                                                const std::vector<double>& frame_time_s,
                                                const std::optional<Eigen::VectorXd>& from,
                                                const std::optional<Eigen::VectorXd>& last_command,
                                                const std::stop_token& stop) const {
  const Eigen::Vector3d at_contact = track.PositionAt(contact);
  api::ExecuteRequest placed = request;
  placed.objects = {{target, {at_contact, seen.rotation}, true}};
  std::optional<Error> unfit;
  Chase chase;
  chase.start = from;
  chase.adjust = [&](demonstration::SkillMotion& motion) {
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
    if (track.speed() > 0) PushDeeper(*met, motion);
    for (int k = 0; k < motion.frames(); ++k) {
      const Duration when = contact + FromSeconds(at(k) - times.contact_s);
      motion.base_T_tool[static_cast<std::size_t>(k)].translation +=
          times.ShareAt(at(k)) * (track.PositionAt(when) - at_contact);
    }
  };
  Result<Planned> planned = planner_.Plan(placed, last_command, stop, &chase);
  if (unfit) return *unfit;
  if (!planned.ok()) return planned.error();
  FollowingPlan plan{*std::move(planned), Duration(0), target, {}, {}, {}, {}};
  for (const motion::ContactWindow& window : plan.planned.motion.contacts) {
    if (window.object != target) continue;
    plan.times = {window.begin_s, window.end_s};
    plan.object_p_contact = window.base_p_contact - at_contact;
    break;
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
  double release_s = kGuess_s + 1;
  std::vector<double> frame_time_s;
  for (int round = 0;; ++round) {
    const auto seen = Seen(*target);
    if (!seen.ok()) return seen.error();
    const TargetTrack& track = seen->first;
    const Duration earliest = clock_.Steady() + FromSeconds(kLead_s + contact_s);
    Duration contact = earliest;
    double wait_s = 0;
    const auto turns = [&] {
      return track.TurnsWithin(contact - FromSeconds(kCalmBefore_s),
                               contact + FromSeconds(release_s - contact_s + kCalmAfter_s));
    };
    for (; turns() && wait_s < options_.longest_wait_s; wait_s += kWaitStep_s) {
      contact = earliest + FromSeconds(wait_s);
    }
    if (turns()) {
      return FailedPrecondition("target \"" + *target +
                                "\" turns back too often: the touch takes " +
                                FormatFixed(release_s - contact_s, 1) + " s");
    }
    Result<FollowingPlan> plan = PlanFor(request, *target, track, seen->second, contact,
                                         frame_time_s, std::nullopt, last_command, stop);
    if (!plan.ok()) return plan.error();
    const bool timed =
        std::abs(plan->times.contact_s - contact_s) < 0.05 || track.speed() == 0 || round > 1;
    contact_s = plan->times.contact_s;
    release_s = plan->times.release_s;
    frame_time_s = plan->planned.motion.frame_time_s;
    if (track.speed() == 0) plan->start = clock_.Steady();
    if (!timed || clock_.Steady() > plan->start) {
      if (round + 1 < kRounds) continue;
      return Unavailable("target \"" + *target + "\" cannot be followed: planning takes too long");
    }
    // The target is not where the scene has it while the tool goes along with it.
    for (motion::TouchWindow& touch : plan->planned.motion.touches) {
      if (touch.object != *target || track.speed() == 0) continue;
      touch.begin_s = std::min(touch.begin_s, plan->times.begin_s());
      touch.end_s = std::max(touch.end_s, plan->times.end_s());
    }
    plan->path = MakeFollowedPath(robot_.chain, plan->planned.motion.trajectory, plan->times, track,
                                  plan->start);
    (void)Prove(robot_, plan->planned.checker, plan->planned.motion, required_clearance_m(), 0,
                plan->times, plan->path);
    const Eigen::VectorXd levers = plan->planned.checker.LongestLevers();
    plan->lever_m.resize(robot_.chain.dof());
    for (int j = 0; j < robot_.chain.dof(); ++j) {
      plan->lever_m[j] = levers[robot_.chain.joint_indices()[j]];
    }
    return plan;
  }
}

Result<FollowingPlan> FollowingPlanner::Again(const api::ExecuteRequest& request,
                                              const std::string& target,
                                              const motion::PlannedMotion& first,
                                              const TargetTimes& times, Duration start,
                                              const std::stop_token& stop) const {
  const auto seen = Seen(target);
  if (!seen.ok()) return seen.error();
  const Duration contact = start + FromSeconds(times.contact_s);
  Result<FollowingPlan> plan =
      PlanFor(request, target, seen->first, seen->second, contact, first.frame_time_s,
              Eigen::VectorXd(first.trajectory.positions.row(0).transpose()), std::nullopt, stop);
  if (!plan.ok()) return plan;
  plan->path = MakeFollowedPath(robot_.chain, plan->planned.motion.trajectory, plan->times,
                                seen->first, plan->start);
  return plan;
}

}  // namespace exemplar::executor
