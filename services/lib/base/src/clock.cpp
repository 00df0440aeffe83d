#include "exemplar/base/clock.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cassert>
#include <cerrno>
#include <chrono>
#include <climits>

namespace exemplar {
namespace {

static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t));

/// A sleeper's bell: what the kernel watches while the thread sleeps. Never allocates.
class Bell {
 public:
  void Ring() {
    rung_.store(1, std::memory_order_release);
    syscall(SYS_futex, &rung_, FUTEX_WAKE_PRIVATE, INT_MAX, nullptr, nullptr, 0);
  }
  /// False when it rang before the steady clock (CLOCK_MONOTONIC) came to `steady`.
  bool SleepUntil(Duration steady) {
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(steady);
    const timespec until{static_cast<time_t>(seconds.count()),
                         static_cast<long>((steady - seconds).count())};
    while (rung_.load(std::memory_order_acquire) == 0) {
      const long woken = syscall(SYS_futex, &rung_, FUTEX_WAIT_BITSET_PRIVATE, 0, &until, nullptr,
                                 FUTEX_BITSET_MATCH_ANY);
      if (woken != 0 && errno == ETIMEDOUT) return rung_.load(std::memory_order_acquire) == 0;
    }
    return false;
  }

 private:
  std::atomic<std::uint32_t> rung_{0};
};

}  // namespace

Stamp SystemClock::Now() const {
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return Stamp::FromNanoseconds(std::chrono::duration_cast<Duration>(since_epoch).count());
}

Duration SystemClock::Steady() const {
  return std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch());
}

bool SystemClock::SleepUntil(Duration steady, std::stop_token stop) const {
  if (stop.stop_requested()) return false;
  if (steady <= Steady()) return true;
  Bell bell;
  // After the bell: the callback's destructor waits for one that rings.
  const std::stop_callback on_stop(stop, [&bell] { bell.Ring(); });
  return bell.SleepUntil(steady);
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
