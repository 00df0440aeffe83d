#pragma once
#include <cstdint>
#include <mutex>
#include <string>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"

namespace exemplar::bus {

/// Tells of a topic's malformed samples: of the first at once, of those after it once a second with
/// their number, so that a flood of them does not become a flood of lines. Thread-safe.
class Refusals {
 public:
  /// Clock and log outlive this.
  Refusals(std::string topic, const Clock& clock, Log& log);
  /// Tells of those that were not told yet.
  ~Refusals();
  Refusals(const Refusals&) = delete;
  Refusals& operator=(const Refusals&) = delete;

  void Add(const std::string& writer, const std::string& error);
  /// A good sample came: time to tell of those from before it.
  void Tick();
  std::uint64_t total() const;

 private:
  void TellIfDue();

  const std::string topic_;
  const Clock& clock_;
  Log& log_;
  mutable std::mutex mutex_;
  std::uint64_t total_ = 0;
  std::uint64_t told_ = 0;  ///< of `total_`
  Duration next_line_{0};
  std::string last_writer_;
  std::string last_error_;
};

}  // namespace exemplar::bus
