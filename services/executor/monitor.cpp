#include "executor/monitor.hpp"

#include <algorithm>

#include "exemplar/base/text.hpp"

namespace exemplar::executor {

namespace {
/// Below this a touch sensor only breathes.
constexpr double kTouchOnset_n = 0.5;
/// The robot arrives a little after it was asked to: contact is looked for so much longer.
constexpr double kArrival_s = 0.15;
constexpr double kToolPathInterval_s = 1.0 / 60;
constexpr std::size_t kMaxToolPath = 20'000;
}  // namespace

Monitor::Monitor(const kinematics::RobotDescription& robot, const motion::PlannedMotion& plan,
                 collision::CollisionChecker checker, const WatchLimits& limits)
    : robot_(robot),
      plan_(plan),
      checker_(std::move(checker)),
      limits_(limits),
      full_joints_(kinematics::FullJointVector(robot.model, robot.chain, robot.home)) {}

std::optional<std::string> Monitor::Observe(const Measurement& measurement) {
  int worst_joint = 0;
  latest_tracking_rad_ =
      (measurement.joints - measurement.commanded).cwiseAbs().maxCoeff(&worst_joint);
  largest_tracking_rad_ = std::max(largest_tracking_rad_, latest_tracking_rad_);

  const geometry::Pose base_T_tool = robot_.chain.ToolPose(measurement.joints);
  std::vector<collision::AllowedTouch> allowed;
  for (const motion::ContactWindow& window : plan_.contacts) {
    const double t = measurement.path_time_s;
    if (t >= window.begin_s && t <= window.end_s + kArrival_s) {
      const double error = (base_T_tool.translation - window.base_p_contact).norm();
      contact_error_m_ = std::min(contact_error_m_.value_or(error), error);
    }
  }
  for (const motion::TouchWindow& touch : plan_.touches) {
    if (measurement.path_time_s < touch.begin_s) continue;
    if (measurement.path_time_s > touch.end_s + kArrival_s) continue;
    for (const std::string& link : robot_.touch_links) allowed.push_back({link, touch.object});
  }

  if (measurement.touch_n > kTouchOnset_n && !touch_onset_s_) {
    touch_onset_s_ = measurement.elapsed_s;
  }
  touch_max_n_ = std::max(touch_max_n_, measurement.touch_n);

  if (tool_time_s_.size() < kMaxToolPath &&
      (tool_time_s_.empty() ||
       measurement.elapsed_s - tool_time_s_.back() >= kToolPathInterval_s * 0.999)) {
    base_T_tool_.push_back(base_T_tool);
    tool_time_s_.push_back(measurement.elapsed_s);
  }

  for (int j = 0; j < robot_.chain.dof(); ++j) {
    full_joints_[robot_.chain.joint_indices()[j]] = measurement.joints[j];
  }
  const collision::Clearance clearance = checker_.SmallestClearance(full_joints_, allowed);
  smallest_clearance_m_ = std::min(smallest_clearance_m_, clearance.distance_m);

  const std::string when = "at " + FormatFixed(measurement.path_time_s, 2) + " s of the motion ";
  if (latest_tracking_rad_ > limits_.tracking_error_rad) {
    return when + "joint \"" + robot_.chain.joint_names()[worst_joint] + "\" is " +
           FormatFixed(latest_tracking_rad_, 3) + " rad away from where it should be, " +
           FormatFixed(limits_.tracking_error_rad, 3) + " allowed";
  }
  if (measurement.touch_n > limits_.touch_n) {
    return when + "the touch is " + FormatFixed(measurement.touch_n, 1) + " N, " +
           FormatFixed(limits_.touch_n, 1) + " N allowed";
  }
  if (clearance.distance_m < limits_.clearance_m) {
    return when + "\"" + clearance.first + "\" and \"" + clearance.second + "\" are " +
           FormatFixed(1000 * clearance.distance_m, 1) + " mm apart as measured";
  }
  return std::nullopt;
}

void Monitor::Report(api::ExecutionResult& result) const {
  result.tracking_error_rad = largest_tracking_rad_;
  result.clearance_m = smallest_clearance_m_;
  result.contact_error_m = contact_error_m_;
  result.touch_onset_s = touch_onset_s_;
  result.touch_max_n = touch_max_n_;
  result.base_T_tool = base_T_tool_;
  result.tool_time_s = tool_time_s_;
}

}  // namespace exemplar::executor
