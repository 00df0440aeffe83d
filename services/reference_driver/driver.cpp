#include "reference_driver/driver.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace exemplar::reference_driver {
namespace {

bool AllFinite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

std::vector<double> ToList(const Eigen::VectorXd& v) { return {v.data(), v.data() + v.size()}; }

}  // namespace

Driver::Driver(std::vector<std::string> names, std::vector<kinematics::JointLimits> limits,
               const Eigen::VectorXd& start)
    : names_(std::move(names)),
      limits_(std::move(limits)),
      positions_(start),
      velocities_(Eigen::VectorXd::Zero(start.size())),
      target_(start),
      target_velocities_(Eigen::VectorXd::Zero(start.size())) {}

bool Driver::Take(const ircp::JointCommandSample& command, Duration now) {
  const bool has_speeds = !command.velocities.empty();
  bool fits = command.positions.size() == command.names.size() &&
              (!has_speeds || command.velocities.size() == command.names.size()) &&
              AllFinite(command.positions) && AllFinite(command.velocities);
  Eigen::VectorXd target = target_;
  Eigen::VectorXd speeds = Eigen::VectorXd::Zero(target.size());
  bool names_a_joint = false;
  for (std::size_t i = 0; fits && i < command.names.size(); ++i) {
    const auto it = std::find(names_.begin(), names_.end(), command.names[i]);
    if (it == names_.end()) continue;
    const Eigen::Index j = it - names_.begin();
    target[j] = command.positions[i];
    if (has_speeds) speeds[j] = command.velocities[i];
    names_a_joint = true;
  }
  fits = fits && names_a_joint;
  if (!fits) {
    ++refused_;
    return false;
  }
  target_ = target;
  target_velocities_ = speeds;
  received_ = now;
  validity_ = command.validity > Duration(0) ? command.validity : kPatience;
  is_following_ = true;
  command_seq_ = command.header.seq;
  if (command.has_hand_open) hand_open_ = std::clamp(command.hand_open, 0.0, 1.0);
  return true;
}

void Driver::Step(Duration now) {
  const double dt_s = has_stepped_ ? ToSeconds(now - last_step_) : 0;
  last_step_ = now;
  has_stepped_ = true;
  if (dt_s <= 0) return;
  if (is_following_ && now - received_ > validity_) {
    is_following_ = false;
    ++stale_;
  }
  if (!is_following_) return Brake(dt_s);
  const double age_s = ToSeconds(now - received_);
  for (Eigen::Index j = 0; j < positions_.size(); ++j) {
    const kinematics::JointLimits& limit = limits_[static_cast<std::size_t>(j)];
    const double goal =
        std::clamp(target_[j] + age_s * target_velocities_[j], limit.lower, limit.upper);
    const double most = limit.velocity * dt_s;
    const double way = std::clamp(goal - positions_[j], -most, most);
    positions_[j] += way;
    velocities_[j] = way / dt_s;
  }
}

void Driver::Brake(double dt_s) {
  for (Eigen::Index j = 0; j < positions_.size(); ++j) {
    const kinematics::JointLimits& limit = limits_[static_cast<std::size_t>(j)];
    const double less = std::max(0.0, std::abs(velocities_[j]) - limit.acceleration * dt_s);
    velocities_[j] = std::copysign(less, velocities_[j]);
    positions_[j] = std::clamp(positions_[j] + velocities_[j] * dt_s, limit.lower, limit.upper);
  }
  target_ = positions_;
}

ircp::JointStateSample Driver::State() const {
  ircp::JointStateSample state;
  state.names = names_;
  state.positions = ToList(positions_);
  state.velocities = ToList(velocities_);
  state.hand_open = hand_open_;
  state.command_seq = command_seq_;
  return state;
}

}  // namespace exemplar::reference_driver
