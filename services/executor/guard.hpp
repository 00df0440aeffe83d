#pragma once
// Guarded contact: a press goes on a bounded way past the place where contact is expected, slowly,
// and ends by touch.

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "exemplar/demonstration/motion.hpp"
#include "exemplar/kinematics/chain.hpp"
#include "exemplar/motion/plan.hpp"
#include "exemplar/scene/description.hpp"

namespace exemplar::executor {

struct GuardOptions {
  /// A touch from here on ends a press; 0: presses end by position. A button of the scene that
  /// needs more than half of this to click raises it to twice what it needs.
  double touch_n = 0;
  /// Past the place where contact is expected, along the approach; the travel of a button of the
  /// scene comes on top.
  double distance_m = 0.010;
  double speed_m_s = 0.015;  ///< of the tool, from `before_m` before that place on
  double before_m = 0.003;
  /// Where the target moves the guard's way past that place takes no longer: the speed is raised.
  double longest_s = std::numeric_limits<double>::infinity();
};

/// With what a button of the scene asks for beside.
GuardOptions GuardFor(const std::string& object, const scene::Description& scene,
                      GuardOptions options);

/// Where the tool goes in a press (unit vector, base frame); nullopt where the contact is none.
std::optional<Eigen::Vector3d> PressDirection(const demonstration::SkillMotion& motion,
                                              const demonstration::Contact& contact);

/// The motion with each press going on by the guard's distance, slowed; nullopt where it has no
/// press. A contact is a press where the tool comes, goes no deeper than a little past the contact
/// and leaves the way it came; pushing along, or staying, is none. `only`: this contact alone.
std::optional<demonstration::SkillMotion> WithGuard(const demonstration::SkillMotion& motion,
                                                    const scene::Description& scene,
                                                    const GuardOptions& options,
                                                    std::optional<std::size_t> only = {});

/// The press of a planned motion and where each place of its way in has its like on the way out.
struct GuardZone {
  std::string object;
  double touch_n = 0;
  double distance_m = 0;
  double begin_s = 0;                ///< from here on a touch counts
  double deepest_s = 0;              ///< here it must have come
  std::vector<double> leave_s = {};  ///< by kGuardStep_s from begin_s: where the motion goes on

  double LeaveTime(double time_s) const;
};
inline constexpr double kGuardStep_s = 0.002;

/// One a press of the motion that was planned, in its order.
std::vector<GuardZone> GuardZones(const motion::PlannedMotion& plan,
                                  const demonstration::SkillMotion& motion,
                                  const kinematics::Chain& chain, const scene::Description& scene,
                                  const GuardOptions& options);

}  // namespace exemplar::executor
