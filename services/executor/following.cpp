#include "executor/following.hpp"

#include <algorithm>
#include <cmath>

#include "exemplar/base/text.hpp"

namespace exemplar::executor {
namespace {

/// Of the correction, which follows what is wanted like a spring without swinging.
constexpr double kCorrectionRate = 25;  // 1/s
/// The blend into a new plan begins so long after it was made, in which it is proved.
constexpr double kProofTime_s = 0.12;
/// It is not used where less than this is left until then.
constexpr double kTakeOver_s = 0.02;
/// No new plans so shortly before the contact.
constexpr double kLastPlan_s = 0.45;
/// Nearer to the planned place no new plan is worth it.
constexpr double kGoodPlan_m = 1.5e-3;
/// A target is missed only from so long before the contact on.
constexpr double kJudged_s = 0.05;
constexpr std::size_t kMostSeen = 20'000;

/// The frame at or before a time of a path, and how much of the way to the next is gone.
std::pair<std::size_t, double> PlaceAt(const std::vector<double>& time_s, double at_s) {
  const auto after = std::upper_bound(time_s.begin() + 1, time_s.end() - 1, at_s);
  const auto frame = static_cast<std::size_t>(after - time_s.begin()) - 1;
  return {frame,
          std::clamp((at_s - time_s[frame]) / (time_s[frame + 1] - time_s[frame]), 0.0, 1.0)};
}

double DepthAt(const FollowedPath& path, std::size_t frame, double part) {
  return (1 - part) * path.depth_m[frame] + part * path.depth_m[frame + 1];
}

}  // namespace

Following::Following(const Clock& clock, Log& log, const FollowingPlanner& planner,
                     const kinematics::RobotDescription& robot, api::ExecuteRequest request,
                     const FollowingPlan& plan, const motion::PlannedMotion& first)
    : clock_(clock),
      log_(log),
      planner_(planner),
      robot_(robot),
      request_(std::move(request)),
      target_(plan.target),
      object_p_contact_(plan.object_p_contact),
      times_(plan.times),
      press_(plan.press),
      first_(first),
      lever_m_(plan.lever_m),
      offset_(Eigen::VectorXd::Zero(robot.chain.dof())),
      offset_rate_(offset_),
      wanted_(offset_),
      lift_(offset_),
      ahead_q_(offset_),
      ahead_v_(offset_),
      first_q_(offset_),
      first_v_(offset_) {
  paths_.push_back(std::make_unique<const FollowedPath>(plan.path));
  path_.store(paths_.back().get());
  Take(target_);
  used_aim_ = aim_;
}

void Following::Start(std::function<void()> on_settled) {
  on_settled_ = std::move(on_settled);
  {
    const std::lock_guard lock(seen_mutex_);
    plans_ = true;
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { PlanLoop(stop); });
}

Following::~Following() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

// ---------------------------------------------------------------- what is seen

void Following::Take(const std::string& object) {
  if (object != target_) return;
  const auto seen = planner_.tracks().Find(object);
  if (!seen) return;
  SetAim(seen->first);
  {
    const std::lock_guard lock(seen_mutex_);
    is_fresh_ = true;
    if (seen_.size() < kMostSeen) {
      seen_.emplace_back(seen->first.last_seen(), seen->first.PositionAt(seen->first.last_seen()));
    }
  }
  seen_changed_.notify_all();
}

void Following::SetAim(const TargetTrack& track) {
  const Duration now = clock_.Steady();
  const Aim aim{track.last_seen(), track.PositionAt(now), track.VelocityAt(now)};
  const std::lock_guard lock(aim_mutex_);
  aim_ = aim;
  // The position is that of now, the time that of what was seen last.
  aim_.base_p -= ToSeconds(now - aim.time) * aim.velocity_m_s;
}

// ---------------------------------------------------------------- the control loop

Eigen::Vector3d Following::Wanted(const FollowedPath& path, std::size_t frame, double part,
                                  Duration now) {
  const auto row = static_cast<Eigen::Index>(frame);
  const Eigen::Vector3d planned =
      ((1 - part) * path.base_p_object.row(row) + part * path.base_p_object.row(row + 1))
          .transpose();
  const double ahead_s = ToSeconds(now + planner_.options().servo_lag - used_aim_.time);
  return used_aim_.base_p + ahead_s * used_aim_.velocity_m_s - planned;
}

void Following::Correct(double path_time_s, double rate, double elapsed_s,
                        Eigen::Ref<Eigen::VectorXd> position,
                        Eigen::Ref<Eigen::VectorXd> velocity) {
  const Duration now = clock_.Steady();
  if (began_ns_.load(std::memory_order_relaxed) < 0) began_ns_.store(now.count());
  path_time_s_.store(path_time_s, std::memory_order_release);
  rate_.store(rate, std::memory_order_relaxed);
  if (std::unique_lock lock(aim_mutex_, std::try_to_lock); lock) used_aim_ = aim_;

  const FollowedPath& path = *path_.load(std::memory_order_acquire);
  const auto [frame, part] = PlaceAt(path.trajectory.time_s, path_time_s);
  const double share = (1 - part) * path.share[frame] + part * path.share[frame + 1];
  const Eigen::Vector3d wanted_m = share * Wanted(path, frame, part, now);
  wanted_.noalias() = path.joints_m[frame] * wanted_m;
  double way_m = 0;
  for (Eigen::Index j = 0; j < wanted_.size(); ++j) way_m += lever_m_[j] * std::abs(wanted_[j]);
  double kept = way_m > path.spare_m ? path.spare_m / way_m : 1;
  if (rate > 0) {
    Judge(path_time_s, (1 - kept) * wanted_m.norm(), now);
  } else {  // It is to stand still, whatever the target does.
    wanted_ = offset_;
    kept = 1;
  }
  const double back_m = deepest_m_ && rate > 0 ? DepthAt(path, frame, part) - *deepest_m_ : 0;
  if (back_m > 0) {
    lift_.noalias() = path.joints_m[frame] * press_->base_inward;
    wanted_ = kept * wanted_ - back_m * lift_;
    kept = 1;
  }

  motion::Evaluate(first_.trajectory, path_time_s, first_q_, first_v_);
  motion::Evaluate(path.trajectory, path_time_s, ahead_q_, ahead_v_);
  const auto row = static_cast<Eigen::Index>(frame);
  for (Eigen::Index j = 0; j < position.size(); ++j) {
    const kinematics::JointLimits& limits = robot_.chain.limits()[static_cast<std::size_t>(j)];
    const double planned_a = path.acceleration(row, j);
    const double most_a = std::max(0.0, limits.acceleration - planned_a);
    const double most_v = std::max(0.0, limits.velocity - std::abs(ahead_v_[j]));
    const double pull = kCorrectionRate * kCorrectionRate * (kept * wanted_[j] - offset_[j]) -
                        2 * kCorrectionRate * offset_rate_[j];
    offset_rate_[j] += elapsed_s * std::clamp(pull, -most_a, most_a);
    offset_rate_[j] = std::clamp(offset_rate_[j], -most_v, most_v);
    offset_[j] += elapsed_s * offset_rate_[j];
    const double to = ahead_q_[j] + offset_[j];
    position[j] += std::clamp(to, limits.lower, limits.upper) - first_q_[j];
    velocity[j] += rate * (ahead_v_[j] - first_v_[j]) + offset_rate_[j];
  }
}

void Following::LiftOff(double path_time_s) {
  const FollowedPath& path = *path_.load(std::memory_order_acquire);
  const auto [frame, part] = PlaceAt(path.trajectory.time_s, path_time_s);
  deepest_m_ = DepthAt(path, frame, part) - press_->lift_m;
}

void Following::Judge(double path_time_s, double residual_m, Duration now) {
  if (fault_.load(std::memory_order_relaxed) != Fault::kNone) return;
  if (path_time_s > times_.release_s || deepest_m_) return;
  const auto fail = [this](Fault fault, double value) {
    fault_value_.store(value);
    fault_.store(fault, std::memory_order_release);
  };
  const Duration age = now - used_aim_.time;
  if (age > planner_.options().lost_patience) return fail(Fault::kLost, ToSeconds(age));
  const double speed = used_aim_.velocity_m_s.norm();
  if (speed > planner_.options().fastest_m_s) return fail(Fault::kFast, speed);
  if (path_time_s > times_.contact_s - kJudged_s &&
      residual_m > planner_.options().largest_miss_m) {
    fail(Fault::kAway, residual_m);
  }
}

std::optional<std::string> Following::Problem() const {
  const Fault fault = fault_.load(std::memory_order_acquire);
  if (fault == Fault::kNone) return std::nullopt;
  const std::string target = "target \"" + target_ + "\" ";
  const double value = fault_value_.load();
  switch (fault) {
    case Fault::kLost:
      return target + "is lost: not seen for " + FormatFixed(value, 2) + " s";
    case Fault::kFast:
      return target + "is too fast: " + FormatFixed(value, 3) + " m/s, at most " +
             FormatFixed(planner_.options().fastest_m_s, 3) + " can be followed";
    default:
      return target + "is " + FormatFixed(1000 * value, 0) +
             " mm away from where the motion may be led to";
  }
}

// ---------------------------------------------------------------- planning anew

bool Following::IsSettled() const {
  const std::lock_guard lock(seen_mutex_);
  return !plans_ || !(is_fresh_ || is_planning_);
}

bool Following::AwaitSight(const std::stop_token& stop) {
  std::unique_lock lock(seen_mutex_);
  if (!seen_changed_.wait(lock, stop, [this] { return is_fresh_; })) return false;
  is_fresh_ = false;
  is_planning_ = true;
  return true;
}

void Following::SetIdle(bool over) {
  {
    const std::lock_guard lock(seen_mutex_);
    is_planning_ = false;
    plans_ = !over;
  }
  if (on_settled_) on_settled_();
}

void Following::PlanLoop(const std::stop_token& stop) {
  Duration last = clock_.Steady();
  while (AwaitSight(stop)) {
    const double now_s = path_time_s_.load(std::memory_order_acquire);
    if (now_s > times_.contact_s - kLastPlan_s) break;
    const Duration now = clock_.Steady();
    if (now - last >= planner_.options().plan_again && began_ns_.load() >= 0) {
      last = now;
      PlanOnce(stop);
    }
    SetIdle(false);
  }
  SetIdle(true);
}

void Following::PlanOnce(const std::stop_token& stop) {
  // Where the target is lost Judge says so; where the motion is slowed down the plan comes later.
  const auto seen = planner_.Seen(target_);
  if (!seen.ok() || rate_.load() < 1 || path_time_s_.load() > times_.contact_s - kLastPlan_s) {
    return;
  }
  // The motion may have been held on its way: the contact comes that much later.
  const Duration start = clock_.Steady() - FromSeconds(path_time_s_.load());
  const Duration contact = start + FromSeconds(times_.contact_s);
  const FollowedPath& now = *path_.load();
  const std::vector<double>& time = now.trajectory.time_s;
  const auto at = std::lower_bound(time.begin(), time.end() - 1, times_.contact_s);
  const Eigen::Vector3d planned = now.base_p_object.row(at - time.begin()).transpose();
  if ((seen->first.PositionAt(contact) - planned).norm() < kGoodPlan_m) return;

  const Duration begin = clock_.Steady();
  const Result<FollowingPlan> fresh =
      planner_.Again(request_, target_, first_, times_, press_.has_value(), start, stop);
  if (!fresh.ok()) {
    log_.Debug("no new plan", {{"cause", fresh.error().message}});
    return;
  }
  const double begin_s = path_time_s_.load() + kProofTime_s;
  auto path = std::make_unique<FollowedPath>(
      Blend(robot_.chain, now, fresh->path, first_.trajectory,
            fresh->times.contact_s - times_.contact_s, begin_s, times_, press()));
  if (!KeepsLimits(path->trajectory, robot_.chain.limits(), begin_s) ||
      !Prove(robot_, fresh->planned.checker, first_, planner_.required_clearance_m(), begin_s,
             times_, press(), *path)) {
    log_.Debug("new plan not used", {{"cause", "limits or clearance of the change to it"}});
    return;
  }
  if (path_time_s_.load() + kTakeOver_s > begin_s) {
    log_.Debug("new plan not used", {{"cause", "it came too late"}});
    return;
  }
  paths_.push_back(std::move(path));
  path_.store(paths_.back().get(), std::memory_order_release);
  ++blended_;
  log_.Debug("new plan",
             {{"took_s", ToSeconds(clock_.Steady() - begin)}, {"spare_m", paths_.back()->spare_m}});
}

void Following::Report(api::ExecutionResult& result) const {
  result.contact_error_m.reset();
  const Duration began(began_ns_.load());
  const std::lock_guard lock(seen_mutex_);
  for (std::size_t i = 0; i < result.base_T_tool.size(); ++i) {
    const Duration when = began + FromSeconds(result.tool_time_s[i]);
    const auto after = std::lower_bound(seen_.begin(), seen_.end(), when,
                                        [](const auto& a, Duration t) { return a.first < t; });
    if (after == seen_.begin() || after == seen_.end()) continue;
    const auto& [t1, p1] = *after;
    const auto& [t0, p0] = *(after - 1);
    const double part = ToSeconds(when - t0) / std::max(1e-9, ToSeconds(t1 - t0));
    const Eigen::Vector3d contact = p0 + part * (p1 - p0) + object_p_contact_;
    const double error = (result.base_T_tool[i].translation - contact).norm();
    result.contact_error_m = std::min(result.contact_error_m.value_or(error), error);
  }
}

}  // namespace exemplar::executor
