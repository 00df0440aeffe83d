#include "executor/guard.hpp"

#include <algorithm>
#include <cmath>

namespace exemplar::executor {
namespace {

using demonstration::Contact;
using demonstration::SkillMotion;

/// The way of the tool before a contact by which its direction is told.
constexpr double kApproach_m = 0.015;
/// A press goes no deeper past its contact, and no further aside.
constexpr double kDeepestPress_m = 0.015;
constexpr double kWidestPress_m = 0.012;
/// As deep as this less is at the deepest place.
constexpr double kArrived_m = 3e-4;
/// The guard's distance is gone within this before and after the deepest frame, at least.
constexpr double kEase_s = 0.25;
/// At which the tool slows down before the guard.
constexpr double kDeceleration_m_s2 = 0.25;

double Smooth(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10 - 15 * s + 6 * s * s);
}

const Eigen::Vector3d& Tool(const SkillMotion& motion, int frame) {
  return motion.base_T_tool[static_cast<std::size_t>(frame)].translation;
}

double Time(const SkillMotion& motion, int frame) {
  return motion.time_s[static_cast<std::size_t>(frame)];
}

/// The way of one press in a motion.
struct Way {
  Eigen::Vector3d base_inward = Eigen::Vector3d::Zero();  ///< unit vector
  int deepest = 0;                                        ///< frame
  double depth_m = 0;                                     ///< there, past the contact
};

std::optional<Way> WayOf(const SkillMotion& motion, const Contact& contact) {
  if (motion.base_T_tool.empty()) return std::nullopt;
  int before = contact.first;
  while (before > 0 && (Tool(motion, before) - Tool(motion, contact.first)).norm() < kApproach_m) {
    --before;
  }
  const Eigen::Vector3d way = Tool(motion, contact.first) - Tool(motion, before);
  if (way.norm() < 0.5 * kApproach_m) return std::nullopt;
  Way out;
  out.base_inward = way.normalized();
  const auto depth = [&](int frame) {
    return out.base_inward.dot(Tool(motion, frame) - contact.base_p_contact);
  };
  out.deepest = contact.first;
  for (int k = contact.first; k <= contact.last; ++k) {
    if (depth(k) > depth(out.deepest)) out.deepest = k;
    const Eigen::Vector3d off = Tool(motion, k) - Tool(motion, contact.first);
    const double aside = (off - off.dot(out.base_inward) * out.base_inward).norm();
    if (aside > kWidestPress_m) return std::nullopt;
  }
  out.depth_m = depth(out.deepest);
  // Where it stays down, it is there when it arrives.
  const int arrived = out.deepest;
  out.deepest = contact.first;
  while (out.deepest < arrived && depth(out.deepest) < out.depth_m - kArrived_m) ++out.deepest;
  if (std::abs(out.depth_m) > kDeepestPress_m) return std::nullopt;
  // It leaves again, by at least the way by which its coming was told.
  for (int k = out.deepest; k < motion.frames(); ++k) {
    if (depth(k) < out.depth_m - 0.5 * kApproach_m) return out;
  }
  return std::nullopt;
}

/// Moves the press to the guard's depth and slows its way in down.
void Guard(SkillMotion& motion, const Contact& contact, const Way& way,
           const GuardOptions& options) {
  const double deeper = options.distance_m - way.depth_m;
  const double speed_m_s = std::max(options.speed_m_s, options.distance_m / options.longest_s);
  const double deepest_s = Time(motion, way.deepest);
  const double begin_s = std::min(Time(motion, contact.first), deepest_s - kEase_s);
  const double end_s = std::max(Time(motion, contact.last), deepest_s + kEase_s);
  if (deeper > 0) {
    for (int k = 0; k < motion.frames(); ++k) {
      const double t = Time(motion, k);
      const double share = t <= deepest_s ? Smooth((t - begin_s) / (deepest_s - begin_s))
                                          : Smooth((end_s - t) / (end_s - deepest_s));
      motion.base_T_tool[static_cast<std::size_t>(k)].translation +=
          deeper * share * way.base_inward;
    }
  }
  double added_s = 0;
  Eigen::Vector3d last = Tool(motion, 0);
  double last_s = Time(motion, 0);
  for (int k = 1; k < motion.frames(); ++k) {
    const auto frame = static_cast<std::size_t>(k);
    const double step_s = motion.time_s[frame] - last_s;
    const double step_m = (Tool(motion, k) - last).norm();
    last = Tool(motion, k);
    last_s = motion.time_s[frame];
    const double to_go = -way.base_inward.dot(last - contact.base_p_contact) - options.before_m;
    const bool inward = k <= way.deepest && to_go < 0.1 &&
                        (last - contact.base_p_contact).norm() < 0.1 + options.distance_m;
    if (inward) {
      const double fastest =
          std::sqrt(speed_m_s * speed_m_s + 2 * kDeceleration_m_s2 * std::max(to_go, 0.0));
      added_s += std::max(0.0, step_m / fastest - step_s);
    }
    motion.time_s[frame] += added_s;
  }
}

}  // namespace

GuardOptions GuardFor(const std::string& object, const scene::Description& scene,
                      GuardOptions options) {
  for (const scene::Button& button : scene.buttons) {
    if (button.name != object) continue;
    options.touch_n = std::max(options.touch_n, 2 * button.click_force_n);
    options.distance_m += button.travel_m;
  }
  return options;
}

std::optional<Eigen::Vector3d> PressDirection(const SkillMotion& motion, const Contact& contact) {
  const std::optional<Way> way = WayOf(motion, contact);
  if (!way) return std::nullopt;
  return way->base_inward;
}

std::optional<SkillMotion> WithGuard(const SkillMotion& motion, const scene::Description& scene,
                                     const GuardOptions& options, std::optional<std::size_t> only) {
  std::optional<SkillMotion> guarded;
  for (std::size_t i = 0; i < motion.contacts.size(); ++i) {
    if (only && *only != i) continue;
    const Contact& contact = motion.contacts[i];
    const std::optional<Way> way = WayOf(motion, contact);
    if (!way) continue;
    if (!guarded) guarded = motion;
    Guard(*guarded, contact, *way, GuardFor(contact.object, scene, options));
  }
  return guarded;
}

double GuardZone::LeaveTime(double time_s) const {
  const double place = std::round((time_s - begin_s) / kGuardStep_s);
  const double last = static_cast<double>(leave_s.size()) - 1;
  return leave_s[static_cast<std::size_t>(std::clamp(place, 0.0, last))];
}

std::vector<GuardZone> GuardZones(const motion::PlannedMotion& plan, const SkillMotion& motion,
                                  const kinematics::Chain& chain, const scene::Description& scene,
                                  const GuardOptions& options) {
  std::vector<GuardZone> zones;
  Eigen::VectorXd q(chain.dof());
  Eigen::VectorXd unused(chain.dof());
  for (std::size_t i = 0; i < plan.contacts.size() && i < motion.contacts.size(); ++i) {
    const std::optional<Way> way = WayOf(motion, motion.contacts[i]);
    if (!way) continue;
    const motion::ContactWindow& window = plan.contacts[i];
    GuardZone zone;
    zone.object = window.object;
    const GuardOptions own = GuardFor(zone.object, scene, options);
    zone.touch_n = own.touch_n;
    zone.distance_m = own.distance_m;
    zone.begin_s = window.begin_s;
    double end_s = window.end_s;
    for (const motion::TouchWindow& touch : plan.touches) {
      if (touch.object != window.object || touch.begin_s > window.begin_s) continue;
      if (touch.end_s < window.end_s) continue;
      zone.begin_s = touch.begin_s;
      end_s = touch.end_s;
    }
    std::vector<double> depth;
    for (double t = zone.begin_s; t <= end_s; t += kGuardStep_s) {
      motion::Evaluate(plan.trajectory, t, q, unused);
      depth.push_back(way->base_inward.dot(chain.ToolPose(q).translation - window.base_p_contact));
    }
    const std::size_t deepest =
        static_cast<std::size_t>(std::max_element(depth.begin(), depth.end()) - depth.begin());
    if (depth.empty() || deepest == 0) continue;
    zone.deepest_s = zone.begin_s + kGuardStep_s * static_cast<double>(deepest);
    // From the deepest place outwards on both sides.
    std::size_t leave = deepest;
    zone.leave_s.resize(deepest + 1);
    for (std::size_t in = deepest + 1; in-- > 0;) {
      while (leave + 1 < depth.size() && depth[leave] > depth[in]) ++leave;
      zone.leave_s[in] = zone.begin_s + kGuardStep_s * static_cast<double>(leave);
    }
    zones.push_back(std::move(zone));
  }
  return zones;
}

}  // namespace exemplar::executor
