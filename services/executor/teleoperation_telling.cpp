// What teleoperation watches and tells beside its steps.

#include <algorithm>
#include <utility>

#include "executor/teleoperation.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::executor {
namespace {

std::string Seconds(Duration duration) { return FormatFixed(ToSeconds(duration), 2) + " s"; }

}  // namespace

void Teleoperation::WatchLoop(const std::stop_token& stop) {
  std::uint32_t seen = 0;
  std::uint32_t told = 0;
  while (true) {
    work_.wait(seen, std::memory_order_acquire);
    seen = work_.load(std::memory_order_acquire);
    if (stop.stop_requested()) return;
    const std::uint32_t due = due_.load(std::memory_order_relaxed);
    {
      const std::lock_guard lock(watch_mutex_);
      Drain();
    }
    watched_.store(seen);
    host_.on_settled();
    if (due == told) continue;
    told = due;
    beat_.fetch_add(1);
    beat_.notify_all();
  }
}

void Teleoperation::Drain() {
  if (watch_ == nullptr) return;
  TellChanges();
  WatchMeasured();
  FollowScene();
  const std::lock_guard lock(figures_mutex_);
  for (Duration latency{0}; latencies_.Get(latency);) latency_.Add(latency);
}

void Teleoperation::TellChanges() {
  for (PhaseChange change; changes_.Get(change);) {
    const bool held = change.phase == Phase::kHolding && told_ != Phase::kHolding;
    told_ = change.phase;
    std::string detail = Describe(change);
    {
      const std::lock_guard lock(figures_mutex_);
      detail_ = detail;
      if (held && change.reason != HoldReason::kEnded) ++holds_;
      if (change.phase == Phase::kBlocked) ++blocks_;
    }
    log_.Info(ToString(change.phase), {{"detail", detail}});
    if (change.reason == HoldReason::kEnded && change.phase == Phase::kHolding) continue;
    host_.tell(std::string(ToString(change.phase)) + ": " + detail);
  }
}

std::string Teleoperation::Describe(const PhaseChange& change) {
  const TeleoperationOptions& limits = settings_.following;
  const std::string joint =
      "joint \"" + robot_.chain.joint_names()[static_cast<std::size_t>(change.joint)] + "\"";
  switch (change.phase) {
    case Phase::kApproaching:
      return "slowly to the operator's posture";
    case Phase::kFollowing:
      return std::to_string(change.driven) + " of " + std::to_string(robot_.chain.dof()) +
             " joints follow the suit";
    case Phase::kBlocked:
      return watch_->Nearest(Commanded()) + ", " + FormatFixed(1000 * limits.clearance_m, 0) +
             " mm are kept";
    case Phase::kHolding:
      break;
  }
  switch (change.reason) {
    case HoldReason::kNotPressed:
      return "press the dead-man to let the robot follow";
    case HoldReason::kReleased:
      return "the dead-man was released";
    case HoldReason::kDeadManSilent:
      return "nothing came from the dead-man on ircp/safety for " +
             Seconds(limits.dead_man_patience) + "; press it again";
    case HoldReason::kSuitSilent:
      return "nothing usable came on ircp/suit for " + Seconds(limits.suit_patience) + " (" +
             std::to_string(intake_.left_out() + suit_reader_->refused()) +
             " samples were left out); press the dead-man again";
    case HoldReason::kSuitUnknown:
      return "the suit has no joint that drives one of the robot's; see the joint map";
    case HoldReason::kSuitNotFinite:
      return "the suit asks " + joint + " for a position that is no number";
    case HoldReason::kSuitJumps:
      return "the suit jumps by " + FormatFixed(change.value, 2) + " rad at " + joint +
             "; press the dead-man again";
    case HoldReason::kSuitLostJoint:
      return "the suit's samples have nothing for " + joint + " any more";
    case HoldReason::kTooFar:
      return "the operator's posture is " + FormatFixed(change.value, 2) + " rad away at " + joint +
             ", " + FormatFixed(limits.approach_range_rad, 2) +
             " allowed: come nearer, then press the dead-man again";
    case HoldReason::kEnded:
      return "teleoperation is over";
  }
  return "";
}

void Teleoperation::WatchMeasured() {
  std::vector<TeleoperationMeasurement> measured;
  {
    const std::lock_guard lock(figures_mutex_);
    measured.swap(measured_);
  }
  if (measured.empty()) return;
  std::optional<std::string> wrong;
  for (const TeleoperationMeasurement& measurement : measured) {
    std::optional<std::string> found = watch_->Observe(measurement);
    if (found && !wrong) wrong = std::move(found);
  }
  if (wrong && host_.state() == State::kTeleoperating) {
    (void)host_.apply(Event::kFault, *std::move(wrong));
  }
  const std::lock_guard lock(figures_mutex_);
  tracking_rad_ = watch_->tracking_error_rad();
  largest_tracking_rad_ = watch_->largest_tracking_rad();
  touch_n_ = watch_->touch_n();
  touch_max_n_ = watch_->touch_max_n();
  clearance_m_ = watch_->clearance_m();
  smallest_clearance_m_ = watch_->smallest_clearance_m();
}

void Teleoperation::FollowScene() {
  if (std::optional<collision::Scene> moved = planner_.MovedScene({}, {}, placed_)) {
    moved_ = std::move(moved);
    const Status set = watch_->SetScene(*moved_);
    if (!set.ok()) log_.Warning("an object's place is not used", {{"why", set.error().message}});
  }
  if (!moved_ || !active()) return;
  // The step has one checker and this thread another; they are exchanged.
  if (spare_ == nullptr) spare_.reset(retired_.exchange(nullptr));
  if (spare_ == nullptr) spare_.reset(incoming_.exchange(nullptr));
  if (spare_ == nullptr) return;
  if (spare_->SetScene(*moved_).ok()) incoming_.store(spare_.release());
  moved_.reset();
}

}  // namespace exemplar::executor
