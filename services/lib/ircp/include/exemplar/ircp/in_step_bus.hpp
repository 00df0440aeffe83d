#pragma once
// The network of a program in simulated time: what others in step have sent at one moment is handed
// to its readers at the next, in an order that no scheduling decides.

#include <memory>
#include <mutex>

#include "exemplar/base/clock.hpp"
#include "exemplar/ircp/bus_of.hpp"
#include "exemplar/ircp/simulated_time.hpp"

namespace exemplar::ircp {

/// Samples of programs that are not in step, and answers to commands, come at once. Commands come
/// once this program has reached the time at which they were given. A writer's
/// WaitForAcknowledgments waits for the next moment as well, when readers in step have the samples.
/// Thread-safe; the clock outlives all endpoints, and these may outlive the bus.
class InStepBus final : public BusOf<InStepBus>, public RawBus {
 public:
  /// `network` carries the samples, `clock_network` the program's endpoints of ircp/clock; `raw`
  /// may be null: no taps. They outlive the endpoints.
  InStepBus(Bus& network, Bus& clock_network, RawBus* raw, NetworkClock& clock)
      : network_(network), clock_network_(clock_network), raw_(raw), clock_(clock) {}

  template <class Sample>
  Result<std::unique_ptr<Writer<Sample>>> OpenWriter(const std::string& topic,
                                                     const std::string& source);
  template <class Sample>
  Result<std::unique_ptr<Reader>> OpenReader(const std::string& topic, Callback<Sample> callback);

  Result<std::unique_ptr<RawTap>> MakeTap(RawTapOptions options) override;

 private:
  Bus& network_;
  Bus& clock_network_;
  RawBus* const raw_;
  NetworkClock& clock_;
};

// Compiled once, in in_step_bus.cpp.
extern template class BusOf<InStepBus>;

}  // namespace exemplar::ircp
