#include "executor/motion_run.hpp"

#include <utility>

namespace exemplar::executor {

MotionRun::MotionRun(const kinematics::RobotDescription& robot, motion::PlannedMotion plan,
                     collision::CollisionChecker checker, const WatchLimits& limits)
    : plan_(std::move(plan)),
      player_(plan_.trajectory, robot.chain.limits()),
      position_(robot.chain.dof()),
      velocity_(robot.chain.dof()),
      commanded_(plan_.trajectory.positions.row(0).transpose()),
      monitor_(robot, plan_, std::move(checker), limits) {}

const Setpoint& MotionRun::Tick(double elapsed_s, State state, double speed) {
  const bool halting = !IsMoving(state);
  const double target = state == State::kExecuting ? speed : 0.0;
  player_.Advance(elapsed_s, target, 1.0 / (halting ? kStopRamp_s : kPauseRamp_s));
  player_.Evaluate(position_, velocity_);
  if (player_.at_end()) velocity_.setZero();
  for (Eigen::Index j = 0; j < position_.size(); ++j) {
    setpoint_.positions[static_cast<std::size_t>(j)] = position_[j];
    setpoint_.velocities[static_cast<std::size_t>(j)] = velocity_[j];
  }
  elapsed_s_ += elapsed_s;
  path_time_s_.store(player_.time_s(), std::memory_order_relaxed);
  {
    const std::lock_guard lock(mutex_);
    commanded_ = position_;
    commanded_elapsed_s_ = elapsed_s_;
  }
  const bool resting =
      halting ? player_.rate() == 0 : state == State::kExecuting && player_.at_end();
  settled_s_ = resting ? settled_s_ + elapsed_s : 0.0;
  if (settled_s_ >= kSettle_s) finished_.store(true, std::memory_order_release);
  return setpoint_;
}

Eigen::VectorXd MotionRun::commanded() const {
  const std::lock_guard lock(mutex_);
  return commanded_;
}

void MotionRun::Measure(const MeasuredState& state) {
  if (finished()) return;
  touch_n_.store(state.touch_n, std::memory_order_relaxed);
  const std::lock_guard lock(mutex_);
  if (measured_.size() >= kMaxUnwatched) return;  // a watcher that far behind sees the rest
  measured_.push_back(
      {state.joints, commanded_, state.touch_n, path_time_s(), commanded_elapsed_s_});
}

std::optional<std::string> MotionRun::Watch() {
  std::vector<Measurement> measured;
  {
    const std::lock_guard lock(mutex_);
    measured.swap(measured_);
    watching_ = true;
  }
  std::optional<std::string> wrong;
  for (const Measurement& measurement : measured) {
    std::optional<std::string> found = monitor_.Observe(measurement);
    if (found && !wrong) wrong = std::move(found);
  }
  tracking_rad_.store(monitor_.tracking_error_rad(), std::memory_order_relaxed);
  const std::lock_guard lock(mutex_);
  watching_ = false;
  return wrong;
}

bool MotionRun::has_unwatched() const {
  const std::lock_guard lock(mutex_);
  return !measured_.empty() || watching_;
}

void MotionRun::Report(api::ExecutionResult& result) const {
  monitor_.Report(result);
  result.lateness_p99_s = lateness_.QuantileSeconds(0.99);
  result.lateness_max_s = lateness_.max_s();
}

}  // namespace exemplar::executor
