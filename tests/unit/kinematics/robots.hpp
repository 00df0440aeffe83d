#pragma once
// Robots drawn for the tests, and where the outside data lies.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <string>

#include "exemplar/base/rng.hpp"
#include "exemplar/kinematics/chain.hpp"
#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::kinematics::testing {

/// Two links in the x-y plane, 0.5 and 0.3 m long.
inline std::string TwoLinkRobot() {
  return R"(<robot name="two">
  <link name="ground"/>
  <link name="upper"/>
  <link name="lower"/>
  <link name="tool"/>
  <joint name="first" type="revolute">
    <parent link="ground"/><child link="upper"/>
    <axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="2" effort="10"/>
  </joint>
  <joint name="second" type="revolute">
    <origin xyz="0.5 0 0"/>
    <parent link="upper"/><child link="lower"/>
    <axis xyz="0 0 1"/>
    <limit lower="-2.5" upper="2.5" velocity="2" effort="10"/>
  </joint>
  <joint name="end" type="fixed">
    <origin xyz="0.3 0 0"/>
    <parent link="lower"/><child link="tool"/>
  </joint>
</robot>)";
}

/// Every kind of joint, oblique axes, a mimic joint, and two branches (links "tool" and "left").
inline std::string MixedRobot() {
  return R"(<robot name="mixed">
  <link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
  <link name="tool"/><link name="left"/>
  <joint name="slide" type="prismatic">
    <origin xyz="0.1 -0.2 0.3" rpy="0.2 -0.4 0.6"/>
    <parent link="base"/><child link="a"/>
    <axis xyz="1 2 -1"/>
    <limit lower="-0.4" upper="0.5" velocity="1" effort="50"/>
  </joint>
  <joint name="spin" type="continuous">
    <origin xyz="0 0.1 0.2" rpy="1 0 0"/>
    <parent link="a"/><child link="b"/>
    <axis xyz="0 0 -1"/>
  </joint>
  <joint name="follow" type="revolute">
    <origin xyz="0.3 0 0" rpy="0 0.5 0"/>
    <parent link="b"/><child link="c"/>
    <axis xyz="0 3 4"/>
    <limit lower="-3" upper="3" velocity="1" effort="10"/>
    <mimic joint="bend" multiplier="-0.5" offset="0.1"/>
  </joint>
  <joint name="bend" type="revolute">
    <origin xyz="0 0 0.25"/>
    <parent link="c"/><child link="d"/>
    <axis xyz="1 0 0"/>
    <limit lower="-2" upper="2" velocity="1" effort="10"/>
  </joint>
  <joint name="end" type="fixed">
    <origin xyz="0.05 0.02 0.1" rpy="0.3 0.1 -0.2"/>
    <parent link="d"/><child link="tool"/>
  </joint>
  <joint name="other" type="revolute">
    <origin xyz="0 0.3 0" rpy="0 0 1"/>
    <parent link="a"/><child link="left"/>
    <axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="10"/>
  </joint>
</robot>)";
}

inline RobotModel Parse(const std::string& urdf) {
  Result<RobotModel> model = ParseUrdf(urdf, "test.urdf");
  EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().message);
  return model.ok() ? *model : RobotModel{};
}

inline Chain ChainOf(const RobotModel& model, std::string_view base = "",
                     std::string_view tip = "") {
  Result<Chain> chain = Chain::Create(model, base, tip);
  EXPECT_TRUE(chain.ok()) << (chain.ok() ? "" : chain.error().message);
  return *std::move(chain);
}

/// Within the limits; -pi to pi where there are none.
inline Eigen::VectorXd RandomPosture(const Chain& chain, Rng& rng) {
  Eigen::VectorXd q(chain.dof());
  for (int i = 0; i < chain.dof(); ++i) {
    const JointLimits& limits = chain.limits()[static_cast<std::size_t>(i)];
    const bool endless = !std::isfinite(limits.lower);
    q[i] = endless ? rng.Uniform(-std::numbers::pi, std::numbers::pi)
                   : rng.Uniform(limits.lower, limits.upper);
  }
  return q;
}

inline Eigen::VectorXd MiddlePosture(const Chain& chain) {
  Eigen::VectorXd q(chain.dof());
  for (int i = 0; i < chain.dof(); ++i) {
    const JointLimits& limits = chain.limits()[static_cast<std::size_t>(i)];
    q[i] = std::isfinite(limits.lower) ? 0.5 * (limits.lower + limits.upper) : 0.0;
  }
  return q;
}

inline bool WithinLimits(const Chain& chain, const Eigen::VectorXd& q) {
  for (int i = 0; i < chain.dof(); ++i) {
    const JointLimits& limits = chain.limits()[static_cast<std::size_t>(i)];
    if (q[i] < limits.lower || q[i] > limits.upper) return false;
  }
  return true;
}

inline std::filesystem::path ModelFolder(const std::string& robot) {
  return std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "deploy" / "models" / robot;
}

inline std::filesystem::path DataFolder() {
  if (const char* folder = std::getenv("EXEMPLAR_DATA")) return folder;
  return std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "../shared/data";
}

struct NamedChain {
  std::string name;
  RobotModel model;
  Chain chain;
};

/// The chains of deploy/models, and real robots' where the data is there.
inline std::vector<NamedChain> AllChains() {
  struct Source {
    std::filesystem::path urdf;
    const char* base;
    const char* tip;
  };
  const std::filesystem::path real = DataFolder() / "robots";
  const Source sources[] = {
      {ModelFolder("arm7") / "arm7.urdf", "", "tool"},
      {ModelFolder("leonardo") / "leonardo.urdf", "", "tool"},
      {ModelFolder("ur5e_like") / "ur5e_like.urdf", "", "tool"},
      {real / "panda/panda_description/urdf/panda.urdf", "panda_link0", "panda_link8"},
      {real / "ur5e.urdf", "base_link", "tool0"},
      {real / "icub.urdf", "root_link", "r_wrist_1"},
      {real / "jaco.urdf", "j2s7s300_link_base", "j2s7s300_end_effector"}};
  std::vector<NamedChain> chains;
  for (const Source& source : sources) {
    if (!std::filesystem::exists(source.urdf)) continue;
    Result<RobotModel> model = ReadUrdf(source.urdf);
    EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().message);
    if (!model) continue;
    Chain chain = ChainOf(*model, source.base, source.tip);
    chains.push_back({source.urdf.stem().string(), *std::move(model), std::move(chain)});
  }
  return chains;
}

}  // namespace exemplar::kinematics::testing
