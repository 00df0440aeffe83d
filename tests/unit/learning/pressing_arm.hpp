#pragma once
// A three-joint arm and people-free trials of it pressing a button exactly.

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "exemplar/base/rng.hpp"
#include "exemplar/demonstration/tool_kinematics.hpp"
#include "exemplar/learning/skill.hpp"
#include "motions.hpp"

namespace exemplar::learning {

///        z       joints: yaw about z, shoulder and elbow about the turned y
///        | o--   links of 0.5 m and 0.45 m from a shoulder 0.3 m up
///        |/  \   tool: z of the hand down the forearm
class PressingArm final : public demonstration::ToolKinematics {
 public:
  const std::vector<std::string>& joint_names() const override { return names_; }
  geometry::Pose ToolPose(const Eigen::Ref<const Eigen::VectorXd>& q) const override {
    const double radius = kUpper * std::cos(q[1]) + kFore * std::cos(q[1] + q[2]);
    const double height = kHeight + kUpper * std::sin(q[1]) + kFore * std::sin(q[1] + q[2]);
    return {Eigen::Vector3d(radius * std::cos(q[0]), radius * std::sin(q[0]), height),
            Eigen::Quaterniond(Eigen::AngleAxisd(q[0], Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(-(q[1] + q[2]), Eigen::Vector3d::UnitY()))};
  }
  /// Elbow up. Precondition: within reach.
  Eigen::Vector3d Solve(const Eigen::Vector3d& p) const {
    const double radius = std::hypot(p.x(), p.y());
    const double height = p.z() - kHeight;
    const double squared = radius * radius + height * height;
    const double elbow =
        -std::acos((squared - kUpper * kUpper - kFore * kFore) / (2 * kUpper * kFore));
    const double shoulder = std::atan2(height, radius) -
                            std::atan2(kFore * std::sin(elbow), kUpper + kFore * std::cos(elbow));
    return {std::atan2(p.y(), p.x()), shoulder, elbow};
  }

 private:
  static constexpr double kHeight = 0.3, kUpper = 0.5, kFore = 0.45;
  std::vector<std::string> names_ = {"yaw", "shoulder", "elbow"};
};

struct PressOptions {
  double reach_s = 1.2;
  double hold_s = 0.5;
  double retract_s = 0.9;
  double arch_m = 0.08;  ///< how high the reach arches
  bool joints = true;    ///< joints, else tool poses
  bool touch = true;
  Eigen::Vector3d start = {0.45, 0.0, 0.45};
  Eigen::Quaterniond base_R_object = Eigen::Quaterniond::Identity();
  Eigen::Vector3d object_p_contact = Eigen::Vector3d::Zero();
};

/// Rest, reach, hold the button at exactly one point, go back.
inline NamedTrial MakePress(const std::string& id, const Eigen::Vector3d& button,
                            const PressOptions& options) {
  const PressingArm arm;
  constexpr double kRate = 100;
  constexpr double kRest = 0.3;
  const Eigen::Vector3d contact = button + options.base_R_object * options.object_p_contact;
  const double begin = kRest + options.reach_s;
  const double end = begin + options.hold_s;
  const double total = end + options.retract_s + kRest;
  const int n = static_cast<int>(std::lround(total * kRate)) + 1;
  NamedTrial named;
  named.id = id;
  demonstration::Trial& trial = named.trial;
  trial.source = id + ".csv";
  Eigen::MatrixXd joints(n, 3);
  Eigen::MatrixXd touch(n, 1);
  std::vector<double> time;
  std::vector<geometry::Pose> tool, object;
  for (int i = 0; i < n; ++i) {
    const double t = i / kRate;
    const double there = MinimumJerk((t - kRest) / options.reach_s);
    const double back = MinimumJerk((t - end) / options.retract_s);
    const double s = there - back;
    Eigen::Vector3d p = options.start + s * (contact - options.start);
    p.z() += options.arch_m * std::sin(std::numbers::pi * s);
    if (s == 1) p = contact;
    const Eigen::Vector3d q = arm.Solve(p);
    time.push_back(t);
    joints.row(i) = q.transpose();
    touch(i, 0) = s == 1 ? 5.0 : 0.0;
    tool.push_back(arm.ToolPose(q));
    object.push_back({button, options.base_R_object});
  }
  if (options.joints) {
    trial.joints = {arm.joint_names(), time, joints};
  } else {
    trial.end_effectors.push_back({.name = "", .time_s = time, .base_T_frame = tool});
  }
  if (options.touch) trial.tactile = {{"finger"}, time, touch};
  trial.objects.push_back({.name = "button", .time_s = time, .base_T_frame = object});
  return named;
}

inline const std::vector<Eigen::Vector3d>& ButtonPlaces() {
  static const std::vector<Eigen::Vector3d> places = {{.50, -.25, .20}, {.70, .10, .15},
                                                      {.55, .30, .25},  {.75, -.15, .30},
                                                      {.60, .02, .10},  {.48, .12, .33}};
  return places;
}

/// Presses at the first `count` places, each with its own timing and arch.
inline std::vector<NamedTrial> MakePresses(std::size_t count, PressOptions options = {},
                                           std::uint64_t seed = 3) {
  Rng rng(seed);
  std::vector<NamedTrial> trials;
  for (std::size_t j = 0; j < count; ++j) {
    options.reach_s = rng.Uniform(1.0, 1.6);
    options.hold_s = rng.Uniform(0.4, 0.7);
    options.retract_s = rng.Uniform(0.7, 1.2);
    options.arch_m = rng.Uniform(0.06, 0.1);
    trials.push_back(MakePress("press-" + std::to_string(j), ButtonPlaces()[j], options));
  }
  return trials;
}

inline demonstration::SkillQuery ButtonAt(const Eigen::Vector3d& p) {
  demonstration::SkillQuery query;
  query.objects.push_back({"button", geometry::Pose::FromTranslation(p)});
  return query;
}

}  // namespace exemplar::learning
