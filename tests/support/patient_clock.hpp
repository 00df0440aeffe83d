#pragma once
#include <algorithm>
#include <atomic>

#include "exemplar/base/clock.hpp"

namespace exemplar::testing {

/// Time passes only where somebody waits for it or a test says so. Thread-safe.
class PatientClock final : public Clock {
 public:
  Stamp Now() const override {
    return Stamp::FromNanoseconds(steady_ + 1'700'000'000'000'000'000 + jumped_);
  }
  Duration Steady() const override { return Duration(steady_.load()); }
  bool SleepUntil(Duration steady, std::stop_token) const override {
    steady_ = std::max(steady_.load(), steady.count());
    return true;
  }
  void Advance(Duration d) const { steady_ += d.count(); }
  /// The wall clock is set.
  void Jump(Duration d) { jumped_ += d.count(); }

 private:
  mutable std::atomic<std::int64_t> steady_{0};
  std::atomic<std::int64_t> jumped_{0};
};

}  // namespace exemplar::testing
