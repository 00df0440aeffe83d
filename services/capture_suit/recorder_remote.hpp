#pragma once
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/ircp/control.hpp"

namespace exemplar::capture_suit {

/// Tells the recorder when a trial starts and ends, over ircp/recorder/command. Thread-compatible.
class RecorderRemote {
 public:
  /// `demonstrator`: whose demonstrations are recorded, a pseudonymous id; empty: not said.
  static Result<RecorderRemote> Create(ircp::Bus& bus, const Clock& clock, std::uint64_t seed,
                                       const std::string& demonstrator = {});

  /// The recording begins once the recorder hears all of `streams`; it is refused where that takes
  /// more than five seconds. After `stop` the recorder gets half a second to answer.
  Status Start(const std::string& name, const std::string& source,
               const std::vector<ircp::TopicCount>& streams, std::stop_token stop);
  /// Asks in any case; after `stop` the recorder gets half a second to answer.
  Status Stop(std::stop_token stop);

 private:
  RecorderRemote(std::unique_ptr<ircp::ControlClient> client, std::string demonstrator);
  Status Call(const std::string& action, std::map<std::string, std::string> arguments,
              std::stop_token stop);
  std::unique_ptr<ircp::ControlClient> client_;
  std::string demonstrator_;
};

/// The recording's name of trial `index` (from 0) of `count`: `name` itself for a single one, else
/// "NAME-001". An empty name becomes "trial".
std::string RecordingName(const std::string& name, std::size_t index, std::size_t count);

}  // namespace exemplar::capture_suit
