#pragma once
// A recorded trial, sample by sample onto the topics that carry such samples.

#include <map>
#include <memory>
#include <stop_token>
#include <string>
#include <tuple>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/trial_player.hpp"

namespace exemplar::capture_suit {

/// Writers for the topics that a set of trials needs. Thread-safe but for Play, which one thread
/// calls.
class TrialStreams {
 public:
  static Result<TrialStreams> Create(ircp::Bus& bus, const std::vector<ircp::TrialSamples>& trials);

  /// Sends every sample when its stamp says, counted from the first one, `rate` times faster. The
  /// stamps themselves stay, so that a recording keeps the true timing. kCancelled when `stop` came
  /// first.
  Status Play(const ircp::TrialSamples& trial, double rate, const Clock& clock,
              const std::stop_token& stop);

  /// Precondition: a trial had suit samples.
  Status Send(const ircp::SuitSample& sample) {
    return std::get<WriterPtr<ircp::SuitSample>>(writers_)->Write(sample);
  }

  /// How many read each topic.
  std::map<std::string, int> readers() const;
  std::vector<ircp::TopicCount> sent() const;
  /// Waits for that until `timeout` has passed for one of the topics, and then returns false.
  bool WaitForAcknowledgments(Duration timeout);

 private:
  template <class Sample>
  using WriterPtr = std::unique_ptr<ircp::Writer<Sample>>;

  TrialStreams() = default;
  Status Open(ircp::Bus& bus, const ircp::TrialSample& sample);

  /// Null where no trial needs the topic.
  std::tuple<WriterPtr<ircp::SuitSample>, WriterPtr<ircp::EndEffectorSample>,
             WriterPtr<ircp::TactileSample>, WriterPtr<ircp::ObjectSample>>
      writers_;
};

}  // namespace exemplar::capture_suit
