#pragma once
// Commands with answers over ircp/<program>/command and ircp/<program>/status.

#include <functional>
#include <map>
#include <memory>
#include <stop_token>
#include <string>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/rng.hpp"
#include "exemplar/ircp/bus.hpp"

namespace exemplar::ircp {

struct Answer {
  bool ok = true;
  std::string detail;
  std::map<std::string, std::string> values;
};

/// The answering side: de-duplicates by request id (the last 256 answers are kept and given again),
/// drops commands older than their validity (judged from reception on the steady clock), publishes
/// status on change and every second, with the counts of `sent`; answers questions about its clock
/// (clock_watch.hpp). Thread-safe.
class ControlServer {
 public:
  using Handler = std::function<Answer(const CommandSample&)>;  ///< on a thread of the server's own
  static Result<std::unique_ptr<ControlServer>> Create(Bus& bus, const Clock& clock,
                                                       std::string program, Handler handler);
  virtual ~ControlServer() = default;
  virtual void SetState(std::string state, std::string detail) = 0;
  /// Asked whenever a status goes out.
  virtual void SetSentCounts(std::function<std::vector<TopicCount>()> counts) = 0;
  virtual void SetValues(std::function<std::map<std::string, std::string>()> values) = 0;
  /// Told once of each other server of the same program that is seen in this station, by its place
  /// on the network: two would answer the same commands. On a thread of the network.
  virtual void SetOnRival(std::function<void(const std::string& writer)> on_rival) = 0;
};

/// The asking side.
class ControlClient {
 public:
  static Result<std::unique_ptr<ControlClient>> Create(Bus& bus, const Clock& clock,
                                                       std::string program, std::string source,
                                                       std::uint64_t seed);
  virtual ~ControlClient() = default;
  /// Sends, repeats every second with the same request id, returns the answer. kUnavailable: nobody
  /// answered in time; kFailedPrecondition: the answer was no. After `stop` the answer to what was
  /// sent is waited for half a second longer; kCancelled when it did not come.
  virtual Result<Answer> Call(const std::string& action,
                              std::map<std::string, std::string> arguments, Duration timeout,
                              std::stop_token stop = {}) = 0;
};

}  // namespace exemplar::ircp
