#pragma once
// Clocks are passed in, so that no test sleeps.

#include <condition_variable>
#include <mutex>
#include <stop_token>

#include "exemplar/base/stamp.hpp"

namespace exemplar {

/// Thread-safe.
class Clock {
 public:
  virtual ~Clock() = default;
  /// Wall time; may jump.
  virtual Stamp Now() const = 0;
  /// Time since an arbitrary start; never goes back. Deadlines and ages are judged on this one.
  virtual Duration Steady() const = 0;
  /// Returns at `steady`, or earlier when `stop` is requested; false in the second case.
  virtual bool SleepUntil(Duration steady, std::stop_token stop = {}) const = 0;

  bool SleepFor(Duration d, std::stop_token stop = {}) const {
    return SleepUntil(Steady() + d, std::move(stop));
  }
};

/// The machine's clocks. SleepUntil does not allocate and does not spin.
class SystemClock final : public Clock {
 public:
  Stamp Now() const override;
  Duration Steady() const override;
  bool SleepUntil(Duration steady, std::stop_token stop) const override;
};

/// Time that moves only when told: for tests, and for programs that follow simulated time.
class ManualClock final : public Clock {
 public:
  explicit ManualClock(Stamp start = Stamp::FromNanoseconds(1'700'000'000'000'000'000))
      : now_(start) {}
  Stamp Now() const override;
  Duration Steady() const override;
  bool SleepUntil(Duration steady, std::stop_token stop) const override;
  /// Moves both times on and wakes the sleepers. Precondition: d >= 0.
  void Advance(Duration d);

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable_any moved_;
  Stamp now_;
  Duration steady_{0};
};

}  // namespace exemplar
