#pragma once
#include <cstdlib>
#include <optional>

#include "exemplar/base/clock.hpp"

namespace exemplar::recorder {

/// Keeps reception times on one base while the wall clock is set: what was received after a jump is
/// moved back by it, so that the intervals stay true. Thread-compatible.
class ReceptionTime {
 public:
  /// The clock must outlive it.
  explicit ReceptionTime(const Clock& clock) : clock_(clock) {}

  /// Forgets the jumps: from now on the wall clock is right again.
  void Reset() {
    correction_ = Duration(0);
    jumps_ = 0;
    last_offset_.reset();
  }

  Stamp Mend(Stamp received) {
    Look();
    return received + correction_;
  }

  /// Whether the clock has jumped since the last look.
  void Look() {
    // A clock that is only slewed moves by less between two looks.
    constexpr Duration kSmallestJump = std::chrono::milliseconds(100);
    const Duration offset = (clock_.Now() - Stamp()) - clock_.Steady();
    const Duration moved = last_offset_ ? offset - *last_offset_ : Duration(0);
    last_offset_ = offset;
    if (moved > kSmallestJump || moved < -kSmallestJump) {
      correction_ -= moved;
      ++jumps_;
    }
  }

  int jumps() const { return jumps_; }
  /// What is added to the wall clock's times.
  Duration correction() const { return correction_; }

 private:
  const Clock& clock_;
  std::optional<Duration> last_offset_;
  Duration correction_{0};
  int jumps_ = 0;
};

}  // namespace exemplar::recorder
