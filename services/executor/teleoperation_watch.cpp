#include "executor/teleoperation_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "exemplar/base/text.hpp"

namespace exemplar::executor {
namespace {

std::string Apart(const collision::Clearance& clearance) {
  return "\"" + clearance.first + "\" and \"" + clearance.second + "\" are " +
         FormatFixed(1000 * clearance.distance_m, 1) + " mm apart";
}

}  // namespace

TeleoperationWatch::TeleoperationWatch(const kinematics::RobotDescription& robot,
                                       collision::CollisionChecker checker,
                                       std::vector<collision::AllowedTouch> touches,
                                       const WatchLimits& limits)
    : robot_(robot),
      checker_(std::move(checker)),
      touches_(std::move(touches)),
      limits_(limits),
      stream_(robot.chain.joint_names(), robot.chain.limits(), limits.stream),
      full_(kinematics::FullJointVector(robot.model, robot.chain, robot.home)) {}

collision::Clearance TeleoperationWatch::ClearanceAt(const Eigen::VectorXd& joints) {
  for (int j = 0; j < robot_.chain.dof(); ++j) {
    full_[robot_.chain.joint_indices()[j]] = joints[j];
  }
  return checker_.SmallestClearance(full_, touches_);
}

std::string TeleoperationWatch::Nearest(const Eigen::VectorXd& joints) {
  const collision::Clearance nearest = ClearanceAt(joints);
  return nearest.first.empty() ? "nothing is near" : Apart(nearest);
}

std::optional<std::string> TeleoperationWatch::Observe(
    const TeleoperationMeasurement& measurement) {
  const MeasuredState& state = measurement.state;
  std::optional<std::string> wrong = stream_.Judge(
      state, measurement.commanded, measurement.commands_sent, limits_.command_period);
  tracking_rad_ = (state.joints - measurement.commanded).cwiseAbs().maxCoeff();
  largest_tracking_rad_ = std::max(largest_tracking_rad_, tracking_rad_);
  touch_n_ = state.touch_n;
  touch_max_n_ = std::max(touch_max_n_, touch_n_);
  for (int j = 0; j < robot_.chain.dof() && !wrong; ++j) {
    const std::string& name = robot_.chain.joint_names()[j];
    const double off = std::abs(state.joints[j] - measurement.commanded[j]);
    if (off <= limits_.path.Of(name)) continue;
    wrong = "joint \"" + name + "\" is " + FormatFixed(off, 3) +
            " rad away from where it should be, " + FormatFixed(limits_.path.Of(name), 3) +
            " allowed";
  }
  if (!wrong && touch_n_ > limits_.touch_n) {
    wrong = "the touch is " + FormatFixed(touch_n_, 1) + " N, " + FormatFixed(limits_.touch_n, 1) +
            " N allowed";
  }
  const collision::Clearance clearance = ClearanceAt(state.joints);
  clearance_m_ = clearance.distance_m;
  if (!first_clearance_m_) first_clearance_m_ = clearance_m_;
  smallest_clearance_m_ = std::min(smallest_clearance_m_.value_or(*clearance_m_), *clearance_m_);
  // Who begins too near to something must be let out.
  const double allowed = std::min(limits_.clearance_m, *first_clearance_m_ - 1e-3);
  if (!wrong && clearance.distance_m < allowed) wrong = Apart(clearance) + " as measured";
  return wrong;
}

}  // namespace exemplar::executor
