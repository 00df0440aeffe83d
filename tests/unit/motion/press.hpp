#pragma once
// Motions made up for the planner's tests.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "exemplar/demonstration/motion.hpp"
#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::motion::test {

inline kinematics::RobotDescription LoadRobot(const std::string& name) {
  Result<kinematics::RobotDescription> robot = kinematics::ReadRobotDescription(
      std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "deploy" / "models" / name);
  if (!robot.ok()) throw std::runtime_error(robot.error().message);
  return *std::move(robot);
}

inline double MinimumJerk(double r) {
  r = std::clamp(r, 0.0, 1.0);
  return r * r * r * (10 - 15 * r + 6 * r * r);
}

struct PressOptions {
  double reach_s = 1.5;
  double press_s = 0.6;
  double dwell_s = 0.4;
  double rate_hz = 60;
  double above_m = 0.08;
  double depth_m = 0.004;  ///< of the press below the target
};

/// From `start` to above `base_p_target`, down into it, a dwell, up again; orientation as at start.
inline demonstration::SkillMotion MakePress(const geometry::Pose& start,
                                            const Eigen::Vector3d& base_p_target,
                                            const PressOptions& options = {}) {
  demonstration::SkillMotion motion;
  motion.skill = "press";
  const Eigen::Vector3d above = base_p_target + options.above_m * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d pressed = base_p_target - options.depth_m * Eigen::Vector3d::UnitZ();
  const double down = options.reach_s + options.press_s;
  const double up = down + options.dwell_s;
  const double end = up + options.press_s;
  int first = -1;
  int last = -1;
  const int frames = static_cast<int>(std::lround(end * options.rate_hz)) + 1;
  for (int k = 0; k < frames; ++k) {
    const double t = k / options.rate_hz;
    Eigen::Vector3d p =
        start.translation + MinimumJerk(t / options.reach_s) * (above - start.translation);
    p += MinimumJerk((t - options.reach_s) / options.press_s) * (pressed - above);
    p += MinimumJerk((t - up) / options.press_s) * (above - pressed);
    motion.time_s.push_back(t);
    motion.base_T_tool.push_back({p, start.rotation});
    if (t > options.reach_s && p.z() <= base_p_target.z()) {
      if (first < 0) first = k;
      last = k;
    }
  }
  motion.contacts.push_back({"target", first, last, base_p_target, true});
  return motion;
}

}  // namespace exemplar::motion::test
