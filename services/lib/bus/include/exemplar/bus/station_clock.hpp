#pragma once
// The clock of a program: the machine's, or the simulated time of its station.

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>

#include "exemplar/base/clock.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/ircp/simulated_time.hpp"

namespace exemplar::bus {

/// Thread-safe.
class StationClock {
 public:
  /// Follows the simulated time, by a participant of its own (`options`, whose clock is not used),
  /// as the program `name`. Waits until it is heard; kCancelled: `stop` came first. Time waits for
  /// the program until SetInputsTaken.
  static Result<StationClock> Follow(ParticipantOptions options, const std::string& name,
                                     std::stop_token stop);
  /// The machine's.
  StationClock() = default;

  const Clock& operator*() const;
  /// What the simulated time waits for beside the program's loops (ircp::NetworkClock); no meaning
  /// for the machine's clock. Null before what it asks goes.
  void SetCommandsSent(std::function<std::uint64_t()> commands_sent);
  void SetInputsTaken(std::function<bool(const ircp::SentInputs&)> inputs_taken);
  void Recheck();

 private:
  SystemClock system_;
  std::unique_ptr<Participant> participant_;
  std::unique_ptr<ircp::NetworkClock> network_;
};

}  // namespace exemplar::bus
