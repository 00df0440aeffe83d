#pragma once
#include <condition_variable>
#include <mutex>
#include <stop_token>

#include "exemplar/base/clock.hpp"

namespace exemplar::replay {

/// When the message at a place of the recording is due, while it is paused, stepped through, sought
/// in, and played at another rate. Places count from the recording's beginning. Thread-safe; one
/// thread awaits.
class Pace {
 public:
  /// The clock must outlive it.
  Pace(const Clock& clock, Duration start, Duration length, double rate, bool paused);

  enum class Turn {
    kDue,     ///< send it
    kSought,  ///< another place was chosen: go on with Begin()
    kStopped,
  };
  /// Returns when the message is due, or something else came between.
  Turn Await(Duration place, const std::stop_token& stop);
  /// The place to read from: what was sought, or where it was restarted. Time counts from now.
  Duration Begin();
  /// The next Begin goes on from there.
  void Restart(Duration place);

  void Pause();
  void Resume();
  void Step();
  void Seek(Duration place);
  void SetRate(double rate);

  bool paused() const;
  double rate() const;
  Duration position() const;
  Duration latest() const;
  Duration mean_lateness() const;

 private:
  // Preconditions: mutex_ is held.
  Duration PositionLocked() const;
  void AnchorLocked(Duration place);
  void WakeLocked();

  const Clock& clock_;
  const Duration length_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::stop_source wake_;  ///< ends the present sleep
  double rate_;
  bool paused_;
  bool sought_ = false;
  int steps_ = 0;
  Duration anchor_place_;   ///< was played, or stood still, at ...
  Duration anchor_steady_;  ///< ... this time
  Duration latest_{0};
  Duration lateness_sum_{0};
  std::int64_t awaited_ = 0;
};

}  // namespace exemplar::replay
