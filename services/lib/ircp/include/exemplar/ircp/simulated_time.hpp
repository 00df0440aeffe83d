#pragma once
// Simulated time over ircp/clock: one program leads, others follow it as their clock, so that a
// whole system runs as fast as it can, in step.
//
// The leader says {mode "sim", stamp: the simulated wall time, first: simulated time since its
// start, second and third: how many joint states and how many poses of objects it has sent so far}
// and says it again until everybody in step has answered {mode "reached", first: that time, third:
// how many joint commands the follower has sent so far}. Only then does it move time on. A follower
// comes to the new time once it has taken in what was sent before, so that the same run gives the
// same result to the last bit.

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/ircp/bus.hpp"

namespace exemplar::ircp {

/// The sources of what a leader's samples count: the simulated robot, and what tracks objects.
inline constexpr const char* kRobotSource = "robot";
inline constexpr const char* kTrackerSource = "tracker";

/// Samples that the leader has sent so far, by their numbers (ircp::Header::seq).
struct SentInputs {
  std::uint64_t joint_states = 0;  ///< of kRobotSource
  std::uint64_t objects = 0;       ///< of kTrackerSource
};

struct NetworkClockOptions {
  /// A thread that a moment woke and that does not sleep again has left its loop: nobody waits for
  /// it longer than so long (of real time). Not at all once a stop has ended a sleep of its.
  Duration patience = std::chrono::seconds(2);
  /// What the leader has sent is waited for no longer than so long (of real time).
  Duration input_patience = std::chrono::seconds(5);
  /// False: nothing is answered before SetInputsTaken, so that time waits for a program that is not
  /// yet complete.
  bool answers_at_once = true;
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
  /// Asked before time moves on: whether everything sent until then was taken in. Null: yes.
  virtual void SetInputsTaken(std::function<bool(const SentInputs&)> inputs_taken) = 0;
  /// Something was taken in: asks again.
  virtual void Recheck() = 0;
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
  /// Says the time and what was sent before, and returns when everybody in step has reached it;
  /// false when `stop` came first. `taken` tells how many of a program's joint commands have
  /// arrived.
  virtual bool Lead(Duration time, Stamp stamp, const SentInputs& sent,
                    const std::function<std::uint64_t(const std::string&)>& taken,
                    std::stop_token stop) = 0;
  /// Wakes Lead to ask `taken` again. Thread-safe.
  virtual void Recheck() = 0;
  /// Who was left behind since the last call.
  virtual std::vector<std::string> TakeLost() = 0;
};

}  // namespace exemplar::ircp
