#pragma once
// Presses of a button by the nine-joint arm of deploy/models/leonardo, about ten seconds at 60 Hz:
// what the learner's figures are measured on.

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "exemplar/base/rng.hpp"
#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/learning/skill.hpp"

namespace exemplar::bench {

inline double MinimumJerk(double s) {
  const double x = std::clamp(s, 0.0, 1.0);
  return x * x * x * (10 - 15 * x + 6 * x * x);
}

/// Rest, reach, hold the button, go back; each trial with a button place and timing of its own.
/// Empty where the arm cannot reach a place.
inline std::vector<learning::NamedTrial> MakeLongPresses(const kinematics::RobotDescription& robot,
                                                         int count, std::uint64_t seed) {
  constexpr double kRate_hz = 60;
  constexpr double kRest_s = 0.5;
  Rng rng(seed);
  const Eigen::Vector3d rest = robot.chain.ToolPose(robot.home).translation;
  std::vector<learning::NamedTrial> trials;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d button =
        rest + Eigen::Vector3d(rng.Uniform(-0.04, 0.10), rng.Uniform(-0.12, 0.12),
                               rng.Uniform(-0.12, -0.05));
    const Result<kinematics::IkSolution> pressed = kinematics::SolveIk(
        robot.chain, geometry::Pose::FromTranslation(button), robot.home, {.use_rotation = false});
    if (!pressed) return {};
    const double reach_s = rng.Uniform(3.6, 4.4);
    const double hold_s = rng.Uniform(1.2, 1.8);
    const double back_s = 2 * 4.75 - reach_s - hold_s;
    const double end_s = 2 * kRest_s + reach_s + hold_s + back_s;
    const auto samples = static_cast<Eigen::Index>(end_s * kRate_hz);
    learning::NamedTrial named;
    named.id = "press-" + std::to_string(i);
    demonstration::Trial& trial = named.trial;
    trial.source = named.id + ".csv";
    std::vector<double> time_s;
    Eigen::MatrixXd joints(samples, robot.chain.dof());
    Eigen::MatrixXd touch(samples, 1);
    for (Eigen::Index k = 0; k < samples; ++k) {
      const double t = static_cast<double>(k) / kRate_hz;
      const double there = MinimumJerk((t - kRest_s) / reach_s);
      const double back = MinimumJerk((t - kRest_s - reach_s - hold_s) / back_s);
      time_s.push_back(t);
      joints.row(k) = (robot.home + (there - back) * (pressed->q - robot.home)).transpose();
      for (Eigen::Index j = 0; j < joints.cols(); ++j) joints(k, j) += 2e-4 * rng.Normal();
      touch(k, 0) = there == 1 && back == 0 ? 5 : 0;
    }
    trial.joints = {robot.chain.joint_names(), time_s, joints};
    trial.tactile = {{"finger"}, time_s, touch};
    trial.objects.push_back(
        {.name = "button",
         .time_s = time_s,
         .base_T_frame = std::vector<geometry::Pose>(static_cast<std::size_t>(samples),
                                                     geometry::Pose::FromTranslation(button))});
    trials.push_back(std::move(named));
  }
  return trials;
}

}  // namespace exemplar::bench
