#pragma once
// Robots and scenes that the simulator's tests use.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "exemplar/base/rng.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/scene/description.hpp"

namespace exemplar::simulator {

inline std::filesystem::path SourceDir() { return EXEMPLAR_SOURCE_DIR; }

/// Fails the test and throws when the folder cannot be read.
inline kinematics::RobotDescription Robot(const std::string& name) {
  Result<kinematics::RobotDescription> robot =
      kinematics::ReadRobotDescription(SourceDir() / "deploy/models" / name);
  EXPECT_TRUE(robot.ok()) << robot.error().message;
  if (!robot) throw std::runtime_error(robot.error().message);
  return std::move(robot).value();
}

inline scene::Description Scene(const std::string& file) {
  Result<scene::Description> scene = scene::ReadDescription(SourceDir() / "deploy/config" / file);
  EXPECT_TRUE(scene.ok()) << scene.error().message;
  if (!scene) throw std::runtime_error(scene.error().message);
  return std::move(scene).value();
}

/// Uniform within the joints' limits.
inline Eigen::VectorXd RandomPosture(const kinematics::Chain& chain, Rng& rng) {
  Eigen::VectorXd q(chain.dof());
  for (int i = 0; i < chain.dof(); ++i) {
    const kinematics::JointLimits& limits = chain.limits()[static_cast<std::size_t>(i)];
    q[i] = rng.Uniform(std::max(limits.lower, -3.0), std::min(limits.upper, 3.0));
  }
  return q;
}

}  // namespace exemplar::simulator
