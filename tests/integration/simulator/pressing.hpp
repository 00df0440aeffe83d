#pragma once
// Moves a robot of a World through postures, for tests.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "robots.hpp"
#include "simulator/world.hpp"

namespace exemplar::simulator {

inline World MakeWorld(const kinematics::RobotDescription& robot, const scene::Description& scene) {
  Result<World> world = World::Create(robot, scene);
  EXPECT_TRUE(world.ok()) << world.error().message;
  if (!world) throw std::runtime_error(world.error().message);
  return std::move(world).value();
}

/// The tool with its z against the button's normal, its tip `above_m` over the cap's face.
inline geometry::Pose ToolOver(const scene::Button& button, const geometry::Pose& base_T_object,
                               double above_m) {
  geometry::Pose object_T_tool;
  object_T_tool.translation = button.object_p_contact + above_m * button.object_normal;
  object_T_tool.rotation =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), -button.object_normal);
  return base_T_object * object_T_tool;
}

/// A posture with the tool there, its roll free, near `seed`.
inline Eigen::VectorXd PostureFor(const kinematics::Chain& chain, const geometry::Pose& base_T_tool,
                                  const Eigen::VectorXd& seed) {
  const Result<kinematics::IkSolution> solved =
      kinematics::SolveIk(chain, base_T_tool, seed, {.free_tool_roll = true, .preferred = seed});
  EXPECT_TRUE(solved.ok()) << solved.error().message;
  return solved.ok() ? solved->q : seed;
}

/// Moves the servos' target along a minimum-jerk path from `from` to `to`; `each` is called after
/// every step with the target. Steps are those of the world.
inline void MoveAlong(
    World& world, const Eigen::VectorXd& from, const Eigen::VectorXd& to, double seconds,
    const std::function<void(const Eigen::VectorXd& target)>& each = [](const Eigen::VectorXd&) {
    }) {
  const int steps = std::max(1, static_cast<int>(seconds / ToSeconds(world.step())));
  for (int i = 1; i <= steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    const Eigen::VectorXd target = from + s * s * s * (10 - 15 * s + 6 * s * s) * (to - from);
    world.SetTarget(target, 30 * s * s * (1 - s) * (1 - s) / seconds * (to - from));
    world.Step();
    each(target);
  }
}

/// Down onto a button and up again in a straight line.
struct Press {
  Eigen::VectorXd above;
  std::vector<Eigen::VectorXd> down;  ///< from `above` on, the last one deepest

  Press(const kinematics::RobotDescription& robot, const scene::Button& button,
        const geometry::Pose& base_T_object, double depth_m) {
    constexpr double kStart = 0.03;
    constexpr int kStretches = 10;
    above = PostureFor(robot.chain, ToolOver(button, base_T_object, kStart), robot.home);
    Eigen::VectorXd q = above;
    for (int i = 1; i <= kStretches; ++i) {
      const double height = kStart - (kStart + depth_m) * i / kStretches;
      q = PostureFor(robot.chain, ToolOver(button, base_T_object, height), q);
      down.push_back(q);
    }
  }

  void GoDown(World& world, double seconds = 0.5) const { Follow(world, seconds, false); }
  void GoUp(World& world, double seconds = 0.5) const { Follow(world, seconds, true); }

 private:
  void Follow(World& world, double seconds, bool back) const {
    std::vector<Eigen::VectorXd> path = {above};
    path.insert(path.end(), down.begin(), down.end());
    if (back) std::reverse(path.begin(), path.end());
    const double each_s = seconds / static_cast<double>(path.size() - 1);
    const int steps = static_cast<int>(each_s / ToSeconds(world.step()));
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      const Eigen::VectorXd speed = (path[i + 1] - path[i]) / each_s;
      for (int k = 1; k <= steps; ++k) {
        world.SetTarget(path[i] + k * ToSeconds(world.step()) * speed, speed);
        world.Step();
      }
    }
    world.SetTarget(path.back(), Eigen::VectorXd::Zero(above.size()));
  }
};

}  // namespace exemplar::simulator
