#include "executor/robot_view.hpp"

#include <algorithm>
#include <cmath>

namespace exemplar::executor {

std::optional<MeasuredState> RobotView::Take(const ircp::JointStateSample& sample,
                                             Duration steady) {
  MeasuredState state;
  state.received = steady;
  state.stamp = sample.header.stamp;
  state.command_seq = sample.command_seq;
  state.joints.resize(static_cast<Eigen::Index>(joint_names_.size()));
  std::string problem;
  for (std::size_t j = 0; j < joint_names_.size() && problem.empty(); ++j) {
    const auto found = std::find(sample.names.begin(), sample.names.end(), joint_names_[j]);
    const auto index = static_cast<std::size_t>(found - sample.names.begin());
    if (index >= sample.positions.size() || !std::isfinite(sample.positions[index])) {
      problem = "the robot's joint state has no position of joint \"" + joint_names_[j] + "\"";
    } else {
      state.joints[static_cast<Eigen::Index>(j)] = sample.positions[index];
    }
  }
  for (const double touch : sample.touch_n) {
    if (!std::isfinite(touch)) continue;
    state.feels_touch = true;
    state.touch_n = std::max(state.touch_n, touch);
  }
  const std::lock_guard lock(mutex_);
  problem_ = problem;
  if (!problem.empty()) return std::nullopt;
  latest_ = state;
  return state;
}

void RobotView::Take(const ircp::ObjectSample& sample, Duration steady) {
  const std::lock_guard lock(mutex_);
  objects_[sample.name] = {{sample.name, sample.base_T_object, sample.has_orientation}, steady};
}

std::optional<MeasuredState> RobotView::latest() const {
  const std::lock_guard lock(mutex_);
  return latest_;
}

std::string RobotView::problem() const {
  const std::lock_guard lock(mutex_);
  return problem_;
}

std::vector<api::SeenObject> RobotView::objects(Duration steady) const {
  const std::lock_guard lock(mutex_);
  std::vector<api::SeenObject> out;
  for (const auto& [name, seen] : objects_) {
    out.push_back({seen.pose, ToSeconds(steady - seen.received)});
  }
  return out;
}

}  // namespace exemplar::executor
