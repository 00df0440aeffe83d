#pragma once
// Offsets between the clocks of a station's programs, over ircp/clock.

#include <memory>
#include <string>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/clock_relation.hpp"

namespace exemplar::ircp {

/// Answers every "probe" with an "echo": `peer` is the asking writer, `first` when it asked (on its
/// clock), `second` when that came and `third` when the answer went (on ours). Every ControlServer
/// has one. Thread-safe.
class ClockResponder {
 public:
  static Result<std::unique_ptr<ClockResponder>> Create(Bus& bus, const Clock& clock,
                                                        const std::string& source);
  virtual ~ClockResponder() = default;
};

struct ClockJump {
  std::string participant;  ///< whose clock; empty: our own
  std::string program;
  Stamp at;  ///< on our clock, when it was noticed
  Duration by{0};
};

/// Asks once a second (faster while it knows little) and follows the clock of each program that
/// answers. A clock that jumps, our own among them, is noticed, counted and logged, each at most
/// every ten seconds. Thread-safe.
class ClockWatch {
 public:
  /// Clock and log outlive it.
  static Result<std::unique_ptr<ClockWatch>> Create(Bus& bus, const Clock& clock, Log& log,
                                                    const std::string& source);
  virtual ~ClockWatch() = default;
  /// As they stand now; a program that has been silent for a minute is left out.
  virtual std::vector<ClockRelation> relations() = 0;
  virtual std::uint64_t jumps() const = 0;
  /// The last ones that nobody has taken.
  virtual std::vector<ClockJump> TakeJumps() = 0;
};

}  // namespace exemplar::ircp
