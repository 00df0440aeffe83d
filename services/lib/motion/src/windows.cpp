#include "windows.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::motion {
namespace {

using demonstration::SkillMotion;

/// From before to after a contact, until the tool is `margin_m` away from where it was at both of
/// the contact's ends, and from the contact's place: a press that goes deeper ends where it would
/// without.
std::pair<double, double> TouchTimes(const JointTrajectory& trajectory,
                                     const kinematics::Chain& chain, const ContactWindow& window,
                                     double margin_m) {
  Eigen::VectorXd q(chain.dof());
  Eigen::VectorXd velocity(chain.dof());
  const auto tool_at = [&](double t) {
    Evaluate(trajectory, t, q, velocity);
    return chain.ToolPose(q).translation;
  };
  const std::vector<double>& time = trajectory.time_s;
  const Eigen::Vector3d at_begin = tool_at(window.begin_s);
  const Eigen::Vector3d at_end = tool_at(window.end_s);
  const auto near = [&](double t) {
    const Eigen::Vector3d tool = tool_at(t);
    return std::min({(tool - at_begin).norm(), (tool - at_end).norm(),
                     (tool - window.base_p_contact).norm()}) <= margin_m;
  };
  auto first = std::upper_bound(time.begin(), time.end(), window.begin_s) - 1;
  while (first != time.begin() && near(*first)) --first;
  auto last = std::lower_bound(time.begin(), time.end() - 1, window.end_s);
  while (last + 1 != time.end() && near(*last)) ++last;
  return {*first, *last};
}

/// The first time from `from_s` on (by frames), or the last before it, at which the tool is farther
/// than `margin_m` from where it is then; else the trajectory's end or begin.
double AwayTime(const JointTrajectory& trajectory, const kinematics::Chain& chain, double from_s,
                double margin_m, bool forwards) {
  Eigen::VectorXd q(chain.dof());
  Eigen::VectorXd velocity(chain.dof());
  const auto tool_at = [&](double t) {
    Evaluate(trajectory, t, q, velocity);
    return chain.ToolPose(q).translation;
  };
  const Eigen::Vector3d there = tool_at(from_s);
  const std::vector<double>& time = trajectory.time_s;
  if (forwards) {
    auto at = std::lower_bound(time.begin(), time.end() - 1, from_s);
    while (at + 1 != time.end() && (tool_at(*at) - there).norm() <= margin_m) ++at;
    return *at;
  }
  auto at = std::upper_bound(time.begin(), time.end(), from_s) - 1;
  while (at != time.begin() && (tool_at(*at) - there).norm() <= margin_m) --at;
  return *at;
}

}  // namespace

void AddContacts(const SkillMotion& motion, const kinematics::Chain& chain,
                 const PlanOptions& options, const std::vector<double>& frame_time_s,
                 double offset_s, PlannedMotion& plan) {
  for (const demonstration::Contact& contact : motion.contacts) {
    const ContactWindow window{contact.object, offset_s + frame_time_s[contact.first],
                               offset_s + frame_time_s[contact.last], contact.base_p_contact};
    const auto [begin_s, end_s] =
        TouchTimes(plan.trajectory, chain, window, options.touch_margin_m);
    plan.touches.push_back({contact.object, std::max(offset_s, begin_s), end_s});
    plan.contacts.push_back(window);
  }
}

void AddCarryWindows(const SkillMotion& motion, const kinematics::Chain& chain,
                     const PlanOptions& options, const std::vector<double>& frame_time_s,
                     double offset_s, PlannedMotion& plan) {
  for (const Carry& carry : options.carries) {
    CarryWindow window{carry.object, carry.held.name, carry.laid.name, carry.from, carry.to};
    window.begin_s = offset_s + frame_time_s[static_cast<std::size_t>(carry.first)];
    window.lifted_s = AwayTime(plan.trajectory, chain, window.begin_s, kLiftedMargin_m, true);
    window.end_s = std::numeric_limits<double>::infinity();
    window.lowered_s = window.left_s = window.end_s;
    if (carry.last < motion.frames()) {
      window.end_s = offset_s + frame_time_s[static_cast<std::size_t>(carry.last)];
      window.lowered_s = AwayTime(plan.trajectory, chain, window.end_s, kLiftedMargin_m, false);
      window.left_s = AwayTime(plan.trajectory, chain, window.end_s, options.touch_margin_m, true);
    }
    plan.carries.push_back(std::move(window));
  }
}

std::vector<collision::AllowedTouch> NotYet(const std::vector<Carry>& carries) {
  std::vector<collision::AllowedTouch> ignored;
  for (const Carry& carry : carries) {
    ignored.push_back({carry.held.name, ""});
    ignored.push_back({"", carry.laid.name});
  }
  return ignored;
}

std::vector<Stretch> MakeStretches(const PlannedMotion& plan,
                                   const std::vector<std::string>& touch_links) {
  const double end_s = plan.trajectory.duration_s();
  std::vector<double> edges = AllowedEdges(plan);
  edges.push_back(0);
  edges.push_back(end_s);
  for (double& edge : edges) edge = std::clamp(edge, 0.0, end_s);
  std::sort(edges.begin(), edges.end());
  std::vector<Stretch> stretches;
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    if (edges[i + 1] - edges[i] <= 0) continue;
    const double middle = 0.5 * (edges[i] + edges[i + 1]);
    stretches.push_back({edges[i], edges[i + 1], AllowedAt(plan, touch_links, middle)});
  }
  return stretches;
}

void MeasureClearance(const JointTrajectory& trajectory, const kinematics::RobotModel& model,
                      const kinematics::Chain& chain, const collision::CollisionChecker& checker,
                      const std::vector<Stretch>& stretches, PlanReport& report) {
  report.smallest_clearance.distance_m = std::numeric_limits<double>::infinity();
  Eigen::VectorXd q = kinematics::FullJointVector(model, chain, trajectory.positions.row(0));
  const std::vector<collision::AllowedTouch> none;
  for (std::size_t i = 0; i < trajectory.time_s.size(); ++i) {
    const double t = trajectory.time_s[i];
    const auto stretch = std::find_if(stretches.begin(), stretches.end(), [&](const Stretch& s) {
      return t >= s.begin_s && t <= s.end_s;
    });
    for (int j = 0; j < chain.dof(); ++j) {
      q[chain.joint_indices()[j]] = trajectory.positions(static_cast<Eigen::Index>(i), j);
    }
    if (!trajectory.hand_open.empty()) {
      kinematics::SetHandOpening(model, trajectory.hand_open[i], q);
    }
    const collision::Clearance clearance =
        checker.SmallestClearance(q, stretch == stretches.end() ? none : stretch->allowed);
    if (clearance.distance_m < report.smallest_clearance.distance_m) {
      report.smallest_clearance = clearance;
      report.smallest_clearance_time_s = t;
    }
  }
}

std::vector<collision::AllowedTouch> AllowedAt(const PlannedMotion& plan,
                                               const std::vector<std::string>& touch_links,
                                               double time_s, double later_s) {
  std::vector<collision::AllowedTouch> allowed;
  for (const TouchWindow& touch : plan.touches) {
    if (time_s < touch.begin_s || time_s > touch.end_s + later_s) continue;
    for (const std::string& link : touch_links) allowed.push_back({link, touch.object});
  }
  for (const CarryWindow& carry : plan.carries) {
    const bool held = time_s >= carry.begin_s && time_s < carry.end_s;
    if (time_s < carry.end_s) allowed.push_back({"", carry.laid});
    if (time_s >= carry.begin_s) allowed.push_back({"", carry.object});
    if (!held) allowed.push_back({carry.held, ""});
    if (held && time_s <= carry.lifted_s + later_s) {
      for (const std::string& object : carry.from) allowed.push_back({carry.held, object});
    }
    if (held && time_s >= carry.lowered_s) {
      for (const std::string& object : carry.to) allowed.push_back({carry.held, object});
    }
    if (time_s > carry.left_s + later_s) continue;
    for (const std::string& link : touch_links) allowed.push_back({link, carry.laid});
  }
  return allowed;
}

std::vector<double> AllowedEdges(const PlannedMotion& plan) {
  std::vector<double> edges;
  for (const TouchWindow& touch : plan.touches) {
    edges.push_back(touch.begin_s);
    edges.push_back(touch.end_s);
  }
  for (const CarryWindow& carry : plan.carries) {
    edges.insert(edges.end(),
                 {carry.begin_s, carry.lifted_s, carry.lowered_s, carry.end_s, carry.left_s});
  }
  return edges;
}

}  // namespace exemplar::motion
