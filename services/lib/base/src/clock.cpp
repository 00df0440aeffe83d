#include "exemplar/base/clock.hpp"

#include <cassert>
#include <chrono>

namespace exemplar {

Stamp SystemClock::Now() const {
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return Stamp::FromNanoseconds(std::chrono::duration_cast<Duration>(since_epoch).count());
}

Duration SystemClock::Steady() const {
  return std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch());
}

bool SystemClock::SleepUntil(Duration steady, std::stop_token stop) const {
  const std::chrono::steady_clock::time_point until{
      std::chrono::duration_cast<std::chrono::steady_clock::duration>(steady)};
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_until(lock, stop, until, [] { return false; });
  return !stop.stop_requested();
}

Stamp ManualClock::Now() const {
  std::lock_guard lock(mutex_);
  return now_;
}

Duration ManualClock::Steady() const {
  std::lock_guard lock(mutex_);
  return steady_;
}

bool ManualClock::SleepUntil(Duration steady, std::stop_token stop) const {
  std::unique_lock lock(mutex_);
  return moved_.wait(lock, stop, [&] { return steady_ >= steady; });
}

void ManualClock::Advance(Duration d) {
  assert(d >= Duration::zero());
  {
    std::lock_guard lock(mutex_);
    now_ = now_ + d;
    steady_ += d;
  }
  moved_.notify_all();
}

}  // namespace exemplar
