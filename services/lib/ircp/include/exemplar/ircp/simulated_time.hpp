#pragma once
// Simulated time over ircp/clock: one program leads, others follow it as their clock, so that a
// whole system runs as fast as it can, in step.
//
// The leader says {mode "sim", stamp: the simulated wall time, first: simulated time since its
// start, second and third: how many joint states and how many poses of objects it has sent so far,
// peer: how many samples everybody in step has sent so far} and says it again until everybody in
// step has answered {mode "reached", first: that time, second: which saying it answers, by its
// number in the header (0: not said), third: how many joint commands the follower has sent so far,
// peer: likewise of all its topics}. Only then does it move time on. What was sent at one moment is
// handed to its readers at the next, in a fixed order and before anybody acts there
// (ircp/in_step_bus.hpp), so that the same run gives the same result to the last bit.
//
// A follower that is not complete yet answers "here", and time waits for it; one that ends says
// "left".

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/ircp/bus.hpp"

namespace exemplar::ircp {

/// The sources of a leader's own samples: the simulated robot, and what tracks objects.
inline constexpr const char* kRobotSource = "robot";
inline constexpr const char* kTrackerSource = "tracker";

struct NetworkClockOptions {
  /// A thread that a moment woke and that does not sleep again has left its loop: nobody waits for
  /// it longer than so long (of real time). Not at all once a stop has ended a sleep of its.
  Duration patience = std::chrono::seconds(2);
  /// What was sent, and what the program does with it, is waited for no longer than so long (of
  /// real time).
  Duration input_patience = std::chrono::seconds(5);
  /// False: the program is "here" until Begin, and time waits for it.
  bool is_complete = true;
};

class StepMail;

/// Time as the leader says it. A moment is answered once every thread that it woke sleeps again,
/// nobody holds the time, and the program has settled. Steady time is 0 until the leader is heard,
/// goes on from where it was when another leader takes over, and stands still while none is there.
/// Thread-safe.
class NetworkClock : public Clock {
 public:
  /// `bus` outlives the clock; its own samples are not stamped by it. `program` is the name under
  /// which it answers.
  static Result<std::unique_ptr<NetworkClock>> Create(Bus& bus, const std::string& program,
                                                      const NetworkClockOptions& options = {});
  /// Asked before each answer and after each sample that was handed over: whether the program has
  /// done all that follows from it, and sent all that it has to send. Null: yes.
  virtual void SetSettled(std::function<bool()> is_settled) = 0;
  /// The answer to that may have changed.
  virtual void Recheck() = 0;
  enum class Caller { kSleeps, kOnlyWaits };
  /// The program is complete: from now on its answers count. Where the caller's own thread will
  /// sleep by this clock, time waits until it does. Returns once the leader waits for the program;
  /// false when it has not done so for two seconds, or `stop` came.
  virtual bool Begin(Caller caller, std::stop_token stop = {}) = 0;
  /// Threads that sleep by this clock.
  virtual int asleep() const = 0;
  /// Until the leader was heard; false when `stop` came first.
  virtual bool WaitForLeader(std::stop_token stop) const = 0;
  /// As SleepUntil, for at most `limit` of real time.
  virtual bool SleepUntilWithin(Duration steady, Duration limit) const = 0;

  /// While somebody holds the time it does not move on.
  virtual void Hold() const = 0;
  virtual void Release() const = 0;
  /// What came and what was sent, for InStepBus.
  virtual StepMail& mail() = 0;
};

/// The clock by which one waits for other programs, a network or a disk: `clock` itself, but the
/// machine's where that is simulated.
const Clock& RealTimeOf(const Clock& clock);

/// Simulated time stands still while one of these is there: what is waited for meanwhile, by
/// RealTimeOf(clock), takes none. Without effect on other clocks.
class TimeHold {
 public:
  explicit TimeHold(const Clock& clock);
  ~TimeHold();
  TimeHold(const TimeHold&) = delete;
  TimeHold& operator=(const TimeHold&) = delete;

 private:
  const NetworkClock* const clock_;
};

struct TimeLeaderOptions {
  /// Programs without which time does not move on: "NAME", or "NAME@SECONDS" for one that is not
  /// waited for before that time.
  std::vector<std::string> in_step_with = {};
  /// Who has answered and is then silent for so long (of real time) is left behind until it answers
  /// again.
  Duration patience = std::chrono::seconds(10);
};

/// Thread-compatible: one thread leads.
class TimeLeader {
 public:
  /// `bus` and `clock` (real time, for patience) outlive the leader. kInvalidArgument: an entry of
  /// in_step_with is neither of the above.
  static Result<std::unique_ptr<TimeLeader>> Create(Bus& bus, const Clock& clock,
                                                    const std::string& program,
                                                    const TimeLeaderOptions& options = {});
  virtual ~TimeLeader() = default;
  /// Whether that sample, and those before it, have come; true for topics that the leader does not
  /// read.
  using HasCome = std::function<bool(const TopicCount&)>;
  /// Says the time and what the leader has sent before, and returns when everybody in step has
  /// reached it and all that they sent has come; false when `stop` came first.
  virtual bool Lead(Duration time, Stamp stamp, const std::vector<TopicCount>& sent,
                    const HasCome& has_come, std::stop_token stop) = 0;
  /// While time stands, programs may act that answered long ago: no answer to what was said until
  /// now counts any more, so that the next Lead returns with what they have sent since.
  virtual void AskAnew() = 0;
  /// Wakes Lead to ask `has_come` again. Thread-safe.
  virtual void Recheck() = 0;
  /// Who was left behind since the last call.
  virtual std::vector<std::string> TakeLost() = 0;
};

/// The leader's own clock: wall time is the machine's until Set, then what was set last. Steady
/// time is the machine's, since the leader's patience goes by it. Thread-safe.
class LeaderClock final : public Clock {
 public:
  void Set(Stamp now) { now_ns_.store(now.nanoseconds()); }
  Stamp Now() const override;
  Duration Steady() const override { return real_.Steady(); }
  bool SleepUntil(Duration steady, std::stop_token stop) const override {
    return real_.SleepUntil(steady, std::move(stop));
  }

 private:
  static constexpr std::int64_t kNotSet = -1;
  SystemClock real_;
  std::atomic<std::int64_t> now_ns_{kNotSet};
};

}  // namespace exemplar::ircp
