#pragma once
// Simulated time over ircp/clock: one program leads, others follow it as their clock, so that a
// whole system runs as fast as it can, in step.
//
// The leader says {mode "sim", stamp: the simulated wall time, first: simulated time since its
// start} and says it again until everybody in step has answered {mode "reached", first: that time,
// third: how many joint commands the follower has sent so far}. Only then does it move time on.

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/ircp/bus.hpp"

namespace exemplar::ircp {

struct NetworkClockOptions {
  /// A thread that a moment woke and that does not sleep again has left its loop: nobody waits for
  /// it longer than so long (of real time).
  Duration patience = std::chrono::milliseconds(500);
};

/// Time as the leader says it. A moment is answered once every thread that it woke sleeps again.
/// Steady time is 0 until the leader is heard, goes on from where it was when another leader takes
/// over, and stands still while none is there. Thread-safe.
class NetworkClock : public Clock {
 public:
  /// `bus` outlives the clock; its own samples are not stamped by it. `program` is the name under
  /// which it answers.
  static Result<std::unique_ptr<NetworkClock>> Create(Bus& bus, const std::string& program,
                                                      const NetworkClockOptions& options = {});
  /// Asked before each answer: joint commands that are on their way. Null: none are sent.
  virtual void SetCommandsSent(std::function<std::uint64_t()> commands_sent) = 0;
  /// Threads that sleep by this clock.
  virtual int asleep() const = 0;
  /// Until the leader was heard; false when `stop` came first.
  virtual bool WaitForLeader(std::stop_token stop) const = 0;
};

struct TimeLeaderOptions {
  /// Programs without which time does not move on.
  std::vector<std::string> in_step_with = {};
  /// Who has answered and is then silent for so long (of real time) is left behind until it answers
  /// again.
  Duration patience = std::chrono::seconds(10);
};

/// Thread-compatible: one thread leads.
class TimeLeader {
 public:
  /// `bus` and `clock` (real time, for patience) outlive the leader.
  static Result<std::unique_ptr<TimeLeader>> Create(Bus& bus, const Clock& clock,
                                                    const std::string& program,
                                                    const TimeLeaderOptions& options = {});
  virtual ~TimeLeader() = default;
  /// Says the time, and returns when everybody in step has reached it; false when `stop` came
  /// first. `taken` tells how many of a program's joint commands have arrived.
  virtual bool Lead(Duration time, Stamp stamp,
                    const std::function<std::uint64_t(const std::string&)>& taken,
                    std::stop_token stop) = 0;
  /// Wakes Lead to ask `taken` again. Thread-safe.
  virtual void Recheck() = 0;
  /// Who was left behind since the last call.
  virtual std::vector<std::string> TakeLost() = 0;
};

}  // namespace exemplar::ircp
