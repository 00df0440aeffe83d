#include "pace.hpp"

#include <algorithm>
#include <cmath>

namespace exemplar::replay {
namespace {

Duration Scaled(Duration d, double factor) {
  return Duration(std::llround(static_cast<double>(d.count()) * factor));
}

}  // namespace

Pace::Pace(const Clock& clock, Duration start, Duration length, double rate, bool paused)
    : clock_(clock),
      length_(length),
      rate_(rate),
      paused_(paused),
      anchor_place_(start),
      anchor_steady_(clock.Steady()) {}

Pace::Turn Pace::Await(Duration place, const std::stop_token& stop) {
  const std::stop_callback wake_on_stop(stop, [this] {
    const std::lock_guard lock(mutex_);
    WakeLocked();
  });
  std::unique_lock lock(mutex_);
  while (true) {
    if (stop.stop_requested()) return Turn::kStopped;
    if (sought_) return Turn::kSought;
    if (paused_) {
      if (steps_ > 0) {
        --steps_;
        AnchorLocked(place);
        return Turn::kDue;
      }
      changed_.wait(lock, stop, [this] { return !paused_ || sought_ || steps_ > 0; });
      continue;
    }
    const Duration due = anchor_steady_ + Scaled(place - anchor_place_, 1 / rate_);
    const Duration late = clock_.Steady() - due;
    if (late >= Duration(0)) {
      latest_ = std::max(latest_, late);
      lateness_sum_ += late;
      ++awaited_;
      return Turn::kDue;
    }
    if (wake_.stop_requested()) wake_ = std::stop_source();
    const std::stop_token woken = wake_.get_token();
    lock.unlock();
    clock_.SleepUntil(due, woken);
    lock.lock();
  }
}

Duration Pace::Begin() {
  const std::lock_guard lock(mutex_);
  sought_ = false;
  AnchorLocked(anchor_place_);
  return anchor_place_;
}

void Pace::Restart(Duration place) {
  const std::lock_guard lock(mutex_);
  AnchorLocked(place);
}

void Pace::Pause() {
  const std::lock_guard lock(mutex_);
  if (paused_) return;
  AnchorLocked(PositionLocked());
  paused_ = true;
  WakeLocked();
}

void Pace::Resume() {
  const std::lock_guard lock(mutex_);
  if (!paused_) return;
  AnchorLocked(anchor_place_);
  paused_ = false;
  steps_ = 0;
  WakeLocked();
}

void Pace::Step() {
  const std::lock_guard lock(mutex_);
  if (!paused_) AnchorLocked(PositionLocked());
  paused_ = true;
  ++steps_;
  WakeLocked();
}

void Pace::Seek(Duration place) {
  const std::lock_guard lock(mutex_);
  AnchorLocked(std::clamp(place, Duration(0), length_));
  sought_ = true;
  WakeLocked();
}

void Pace::SetRate(double rate) {
  const std::lock_guard lock(mutex_);
  AnchorLocked(PositionLocked());
  rate_ = rate;
  WakeLocked();
}

bool Pace::paused() const {
  const std::lock_guard lock(mutex_);
  return paused_;
}

double Pace::rate() const {
  const std::lock_guard lock(mutex_);
  return rate_;
}

Duration Pace::position() const {
  const std::lock_guard lock(mutex_);
  return PositionLocked();
}

Duration Pace::latest() const {
  const std::lock_guard lock(mutex_);
  return latest_;
}

Duration Pace::mean_lateness() const {
  const std::lock_guard lock(mutex_);
  return awaited_ == 0 ? Duration(0) : lateness_sum_ / awaited_;
}

Duration Pace::PositionLocked() const {
  if (paused_ || sought_) return anchor_place_;
  const Duration played = Scaled(clock_.Steady() - anchor_steady_, rate_);
  return std::clamp(anchor_place_ + played, Duration(0), length_);
}

void Pace::AnchorLocked(Duration place) {
  anchor_place_ = place;
  anchor_steady_ = clock_.Steady();
}

void Pace::WakeLocked() {
  wake_.request_stop();
  changed_.notify_all();
}

}  // namespace exemplar::replay
