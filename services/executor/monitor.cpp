#include "executor/monitor.hpp"

#include <algorithm>
#include <cmath>

#include "exemplar/base/text.hpp"

namespace exemplar::executor {

namespace {
/// Below this a touch sensor only breathes.
constexpr double kTouchOnset_n = 0.5;
/// The robot arrives a little after it was asked to: contact is looked for so much longer.
constexpr double kArrival_s = 0.15;
constexpr double kToolPathInterval_s = 1.0 / 60;
constexpr std::size_t kMaxToolPath = 20'000;
/// Over which the speed of an approach is averaged.
constexpr double kClosingTime_s = 0.04;
constexpr double kLeastSpeedShare = 0.1;
constexpr double kLookStep_s = 0.04;

std::string Apart(const collision::Clearance& clearance) {
  return "\"" + clearance.first + "\" and \"" + clearance.second + "\" are " +
         FormatFixed(1000 * clearance.distance_m, 1) + " mm apart";
}
}  // namespace

double JointTolerance::Of(const std::string& joint) const {
  const auto found = of_joint.find(joint);
  return found == of_joint.end() ? general : found->second;
}

Result<JointTolerance> ParseTolerance(const std::vector<std::string>& words,
                                      const std::vector<std::string>& joint_names, double general) {
  JointTolerance tolerance{general, {}};
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    const std::string joint = equals == std::string::npos ? "" : word.substr(0, equals);
    const std::optional<double> value =
        ParseDouble(equals == std::string::npos ? word : word.substr(equals + 1));
    if (!value || !(*value > 0)) {
      return InvalidArgument("tolerance \"" + word +
                             "\" is no positive number, and no JOINT=NUMBER");
    }
    if (equals == std::string::npos) {
      tolerance.general = *value;
    } else if (std::find(joint_names.begin(), joint_names.end(), joint) == joint_names.end()) {
      return InvalidArgument("tolerance \"" + word + "\": the robot has no joint \"" + joint +
                             "\"; it has " + Join(joint_names, ", "));
    } else {
      tolerance.of_joint[joint] = *value;
    }
  }
  return tolerance;
}

Monitor::Monitor(const kinematics::RobotDescription& robot, const motion::PlannedMotion& plan,
                 collision::CollisionChecker checker, const WatchLimits& limits)
    : robot_(robot),
      plan_(plan),
      checker_(std::move(checker)),
      limits_(limits),
      stream_(robot.chain.joint_names(), robot.chain.limits(), limits.stream),
      full_joints_(kinematics::FullJointVector(robot.model, robot.chain, robot.home)),
      ahead_(robot.chain.dof()),
      ahead_velocity_(robot.chain.dof()) {}

Status Monitor::SetScene(collision::Scene scene) {
  Status set = checker_.SetScene(std::move(scene));
  if (!set.ok()) return set;
  scene_changed_ = true;
  looked_ahead_at_s_ = -limits_.look_again_s;
  return {};
}

void Monitor::OpenHandAsAt(double path_time_s) {
  if (plan_.trajectory.hand_open.empty()) return;
  kinematics::SetHandOpening(robot_.model, motion::EvaluateHand(plan_.trajectory, path_time_s),
                             full_joints_);
}

collision::Clearance Monitor::ClearanceOf(const Eigen::VectorXd& joints,
                                          const std::vector<collision::AllowedTouch>& allowed) {
  for (int j = 0; j < robot_.chain.dof(); ++j) {
    full_joints_[robot_.chain.joint_indices()[j]] = joints[j];
  }
  return checker_.SmallestClearance(full_joints_, allowed);
}

void Monitor::NoteTouch(const Measurement& measurement, const geometry::Pose& base_T_tool) {
  for (const motion::ContactWindow& window : plan_.contacts) {
    const double t = measurement.path_time_s;
    if (t >= window.begin_s && t <= window.end_s + kArrival_s) {
      const double error = (base_T_tool.translation - window.base_p_contact).norm();
      contact_error_m_ = std::min(contact_error_m_.value_or(error), error);
    }
  }
  const double touch_n = measurement.state.touch_n;
  if (touch_n > kTouchOnset_n && !touch_onset_s_) touch_onset_s_ = measurement.elapsed_s;
  touch_max_n_ = std::max(touch_max_n_, touch_n);
}

void Monitor::NoteArrival(const Eigen::VectorXd& joints) {
  not_arrived_.reset();
  const motion::JointTrajectory& path = plan_.trajectory;
  const Eigen::VectorXd off =
      (joints - path.positions.row(path.positions.rows() - 1).transpose()).cwiseAbs();
  for (int j = 0; j < robot_.chain.dof(); ++j) {
    const std::string& name = robot_.chain.joint_names()[j];
    if (off[j] <= limits_.goal.Of(name)) continue;
    not_arrived_ = "at the end of the motion joint \"" + name + "\" is " + FormatFixed(off[j], 3) +
                   " rad away from where it should be, " + FormatFixed(limits_.goal.Of(name), 3) +
                   " allowed";
    return;
  }
}

void Monitor::NoteApproach(const collision::Clearance& clearance, Duration received) {
  const double apart_s = ToSeconds(received - last_received_);
  const bool same = last_clearance_ && last_clearance_->first == clearance.first &&
                    last_clearance_->second == clearance.second;
  if (!same) {
    closing_m_s_ = 0;
  } else if (apart_s > 0) {
    const double closing = (last_clearance_->distance_m - clearance.distance_m) / apart_s;
    closing_m_s_ += std::min(1.0, apart_s / kClosingTime_s) * (closing - closing_m_s_);
  }
  last_clearance_ = clearance;
  last_received_ = received;
  speed_share_ = 1;
  if (clearance.distance_m >= limits_.slow_within_m || closing_m_s_ <= 0) return;
  const double left_m = std::max(0.0, clearance.distance_m - limits_.clearance_m);
  const double share = left_m / (closing_m_s_ * limits_.slow_horizon_s);
  // In tenths, so that the speed along the path is not changed at every state.
  speed_share_ = std::clamp(std::floor(10 * share) / 10, kLeastSpeedShare, 1.0);
}

std::optional<std::string> Monitor::JointOffPath(const Measurement& measurement) const {
  for (int j = 0; j < robot_.chain.dof(); ++j) {
    const std::string& name = robot_.chain.joint_names()[j];
    const double off = std::abs(measurement.state.joints[j] - measurement.commanded[j]);
    if (off <= limits_.path.Of(name)) continue;
    return "joint \"" + name + "\" is " + FormatFixed(off, 3) +
           " rad away from where it should be, " + FormatFixed(limits_.path.Of(name), 3) +
           " allowed";
  }
  return std::nullopt;
}

std::optional<std::string> Monitor::LookAhead(const Measurement& measurement) {
  if (!scene_changed_) return std::nullopt;
  if (measurement.elapsed_s - looked_ahead_at_s_ < limits_.look_again_s) return std::nullopt;
  looked_ahead_at_s_ = measurement.elapsed_s;
  const double end_s =
      std::min(measurement.path_time_s + limits_.look_ahead_s, plan_.trajectory.duration_s());
  for (double t = measurement.path_time_s; t <= end_s; t += kLookStep_s) {
    motion::Evaluate(plan_.trajectory, t, ahead_, ahead_velocity_);
    OpenHandAsAt(t);
    const collision::Clearance clearance =
        ClearanceOf(ahead_, motion::AllowedAt(plan_, robot_.touch_links, t));
    if (clearance.distance_m >= limits_.clearance_m) continue;
    return "something moved into the way: " + FormatFixed(t - measurement.path_time_s, 2) +
           " s ahead " + Apart(clearance);
  }
  return std::nullopt;
}

std::optional<std::string> Monitor::Observe(const Measurement& measurement) {
  const Eigen::VectorXd& joints = measurement.state.joints;
  latest_tracking_rad_ = (joints - measurement.commanded).cwiseAbs().maxCoeff();
  largest_tracking_rad_ = std::max(largest_tracking_rad_, latest_tracking_rad_);
  std::optional<std::string> wrong = stream_.Judge(
      measurement.state, measurement.commanded, measurement.commands_sent, limits_.command_period);

  const geometry::Pose base_T_tool = robot_.chain.ToolPose(joints);
  NoteTouch(measurement, base_T_tool);
  NoteArrival(joints);
  if (tool_time_s_.size() < kMaxToolPath &&
      (tool_time_s_.empty() ||
       measurement.elapsed_s - tool_time_s_.back() >= kToolPathInterval_s * 0.999)) {
    base_T_tool_.push_back(base_T_tool);
    tool_time_s_.push_back(measurement.elapsed_s);
  }
  OpenHandAsAt(measurement.path_time_s);
  const collision::Clearance clearance = ClearanceOf(
      joints, motion::AllowedAt(plan_, robot_.touch_links, measurement.path_time_s, kArrival_s));
  smallest_clearance_m_ = std::min(smallest_clearance_m_, clearance.distance_m);
  NoteApproach(clearance, measurement.state.received);

  if (!wrong) wrong = JointOffPath(measurement);
  if (!wrong && measurement.state.touch_n > limits_.touch_n) {
    wrong = "the touch is " + FormatFixed(measurement.state.touch_n, 1) + " N, " +
            FormatFixed(limits_.touch_n, 1) + " N allowed";
  }
  if (!wrong && clearance.distance_m < limits_.clearance_m) {
    wrong = Apart(clearance) + " as measured";
  }
  if (!wrong) wrong = LookAhead(measurement);
  if (!wrong) return std::nullopt;
  return "at " + FormatFixed(measurement.path_time_s, 2) + " s of the motion " + *wrong;
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
