#pragma once
#include <cstdint>
#include <map>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/ircp/samples.hpp"

namespace exemplar::capture_suit {

/// The first trial begins without those who have not come to read it by then: programs that were
/// started at the same time are there sooner, on a busy machine too.
inline constexpr Duration kReaderTimeout = std::chrono::seconds(10);

/// What is waited for at a trial's end until every reader has all of it. Longer than a silent
/// reader takes to count as gone (docs/topics.md), so that a link that is cut across the end loses
/// nothing.
inline constexpr Duration kAcknowledgeTimeout = std::chrono::seconds(45);

/// A robot that is to follow has so long to come to where the trial begins.
inline constexpr Duration kFollowTimeout = std::chrono::seconds(20);
/// A robot has so long to come to rest at the end of a trial before the switch is released.
inline constexpr Duration kHeldAfter = std::chrono::milliseconds(300);

/// Trials, one after the other, onto the topics. Run on one thread; the rest is thread-safe.
class Session {
 public:
  virtual ~Session() = default;
  /// Ends after the last trial, at the first error, or soon after `stop` (kCancelled; a recording
  /// that runs is stopped first).
  virtual Status Run(std::stop_token stop) = 0;
  virtual std::vector<ircp::TopicCount> sent() const = 0;
  /// How many read each topic that trials are sent on.
  virtual std::map<std::string, int> readers() const = 0;
  virtual std::uint64_t trials_ended() const = 0;
};

}  // namespace exemplar::capture_suit
