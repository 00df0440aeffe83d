#include "executor/motion_run.hpp"

#include <algorithm>
#include <utility>

namespace exemplar::executor {

namespace {
/// Of the plan's time, from the way in to the way out of a press that met its touch.
constexpr double kSplice_s = 0.2;
}  // namespace

MotionRun::MotionRun(const kinematics::RobotDescription& robot, motion::PlannedMotion plan,
                     collision::CollisionChecker checker, const WatchLimits& limits,
                     std::vector<GuardZone> zones)
    : plan_(std::move(plan)),
      zones_(std::move(zones)),
      player_(plan_.trajectory, robot.chain.limits()),
      position_(robot.chain.dof()),
      velocity_(robot.chain.dof()),
      commanded_(plan_.trajectory.positions.row(0).transpose()),
      monitor_(robot, plan_, std::move(checker), limits) {
  splice_.offset = Eigen::VectorXd::Zero(robot.chain.dof());
  splice_.slope_per_s = Eigen::VectorXd::Zero(robot.chain.dof());
}

void MotionRun::FollowGuard(State state) {
  if (zone_ >= zones_.size() || state != State::kExecuting) return;
  const GuardZone& zone = zones_[zone_];
  const double now_s = player_.time_s();
  if (now_s < zone.begin_s) return;
  if (now_s >= zone.deepest_s) {
    if (missed_.load(std::memory_order_relaxed) < 0) missed_.store(static_cast<int>(zone_));
    ++zone_;
  } else if (touch_n_.load(std::memory_order_relaxed) >= zone.touch_n) {
    // What goes along with a moving target must stay on its time.
    if (follower_ != nullptr) {
      follower_->LiftOff(now_s);
    } else {
      BeginSplice(zone.LeaveTime(now_s));
    }
    ++zone_;
  }
}

void MotionRun::BeginSplice(double leave_s) {
  // By the plan's time: the rate is the same before and after.
  motion::Evaluate(plan_.trajectory, player_.time_s(), splice_.offset, splice_.slope_per_s);
  player_.SkipTo(leave_s);
  motion::Evaluate(plan_.trajectory, leave_s, position_, velocity_);
  splice_.offset -= position_;
  splice_.slope_per_s -= velocity_;
  splice_.begin_s = leave_s;
  splice_.duration_s = std::min(kSplice_s, duration_s() - leave_s);
}

void MotionRun::AddSplice() {
  const double d = splice_.duration_s;
  const double s = d > 0 ? (player_.time_s() - splice_.begin_s) / d : 1;
  if (s >= 1) return;
  // Fifth degree: the difference in position and speed at its begin, none at its end.
  const double s2 = s * s;
  const double of_offset = 1 - s2 * s * (10 - 15 * s + 6 * s2);
  const double of_slope = s * (1 - s2 * (6 - 8 * s + 3 * s2));
  const double offset_rate = -30 * s2 * (1 - s) * (1 - s) / d;
  const double slope_rate = 1 - s2 * (18 - 32 * s + 15 * s2);
  for (Eigen::Index j = 0; j < position_.size(); ++j) {
    position_[j] += of_offset * splice_.offset[j] + d * of_slope * splice_.slope_per_s[j];
    velocity_[j] +=
        player_.rate() * (offset_rate * splice_.offset[j] + slope_rate * splice_.slope_per_s[j]);
  }
}

const Setpoint& MotionRun::Tick(double elapsed_s, State state, double speed) {
  const bool halting = !IsMoving(state);
  const double most = std::min(speed, speed_share_.load(std::memory_order_relaxed));
  const double target = state == State::kExecuting ? most : 0.0;
  player_.Advance(elapsed_s, target, 1.0 / (halting ? kStopRamp_s : kPauseRamp_s));
  FollowGuard(state);
  player_.Evaluate(position_, velocity_);
  AddSplice();
  if (follower_ != nullptr) {
    follower_->Correct(player_.time_s(), player_.rate(), elapsed_s, position_, velocity_);
  }
  if (!plan_.trajectory.hand_open.empty()) {
    setpoint_.hand_open = motion::EvaluateHand(plan_.trajectory, player_.time_s());
  }
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
  const bool wait = !halting && !arrived_.load(std::memory_order_relaxed);
  if (settled_s_ >= kSettle_s + (wait ? kArrivalPatience_s : 0.0))
    finished_.store(true, std::memory_order_release);
  return setpoint_;
}

Eigen::VectorXd MotionRun::commanded() const {
  const std::lock_guard lock(mutex_);
  return commanded_;
}

const GuardZone* MotionRun::missed() const {
  const int zone = missed_.load();
  return zone < 0 ? nullptr : &zones_[static_cast<std::size_t>(zone)];
}

std::optional<std::string> MotionRun::not_arrived() const {
  const std::lock_guard lock(mutex_);
  return not_arrived_;
}

void MotionRun::Measure(const MeasuredState& state, std::uint64_t sent) {
  if (finished()) return;
  touch_n_.store(state.touch_n, std::memory_order_relaxed);
  const std::lock_guard lock(mutex_);
  if (measured_.size() >= kMaxUnwatched) return;  // a watcher that far behind sees the rest
  measured_.push_back({commanded_, path_time_s(), commanded_elapsed_s_, state, sent});
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
  speed_share_.store(monitor_.speed_share(), std::memory_order_relaxed);
  arrived_.store(!monitor_.not_arrived(), std::memory_order_relaxed);
  const std::lock_guard lock(mutex_);
  not_arrived_ = monitor_.not_arrived();
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
