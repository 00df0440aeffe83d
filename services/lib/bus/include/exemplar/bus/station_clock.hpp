#pragma once
// The clock of a program: the machine's, or the simulated time of its station.

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/ircp/in_step_bus.hpp"
#include "exemplar/ircp/simulated_time.hpp"

namespace exemplar::bus {

/// What `--clock` says: made first, then the participant by `network`, then the program over
/// `bus(participant)`, then Begin. Thread-safe.
class StationClock {
 public:
  /// `kind` as CommonOptions::clock ("system", "network"). The simulated time is followed by a
  /// participant of its own, as the program `name`; waits until it is heard; kCancelled: `stop`
  /// came first. Time waits for the program until Begin. Sets clock and stamps in `network`.
  static Result<StationClock> Create(const std::string& kind, ParticipantOptions& network,
                                     const std::string& name, std::stop_token stop);
  StationClock(StationClock&&) = default;
  StationClock& operator=(StationClock&&) = default;
  ~StationClock() = default;

  const Clock& operator*() const;
  bool is_simulated() const { return network_ != nullptr; }
  /// What the program talks over: `participant` itself, but in step with the others where time is
  /// simulated. Call once.
  ircp::Bus& bus(Participant& participant);
  /// Likewise; after bus().
  ircp::RawBus& raw_bus(Participant& participant);

  /// What the simulated time waits for beside the program's loops (ircp::NetworkClock); no meaning
  /// for the machine's clock. Null before what it asks goes.
  void SetSettled(std::function<bool()> is_settled);
  void Recheck();
  /// The program is complete. Says in the log when the simulator does not wait for it.
  void Begin(ircp::NetworkClock::Caller caller, Log& log, std::stop_token stop = {});

 private:
  StationClock() = default;
  std::string name_;
  std::unique_ptr<SystemClock> system_;
  std::unique_ptr<Participant> participant_;
  std::unique_ptr<ircp::NetworkClock> network_;
  std::unique_ptr<ircp::InStepBus> bus_;
};

}  // namespace exemplar::bus
