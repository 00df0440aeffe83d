#pragma once
// The touch that a robot's hand measures, as a touch sensor's own stream: ircp/joint_state ->
// ircp/tactile.

#include <cstdint>
#include <memory>
#include <stop_token>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/ircp/bus.hpp"

namespace exemplar::capture_tactile {

struct SessionOptions {
  double rate_hz = 60;  ///< how often the newest force is polled (PAPER.md section 2)
  /// A state older than this is not published again: a silent robot shows as silence, not as a
  /// constant force.
  Duration freshness = std::chrono::milliseconds(500);
};

/// Polls the newest joint state's touch at a rate of its own and sends it with the state's own time
/// stamp, each state once. Status (program "capture_tactile"): `polls`, `stale`.
class Session {
 public:
  /// `bus`, `clock` and `log` outlive the session.
  static Result<std::unique_ptr<Session>> Create(ircp::Bus& bus, const Clock& clock, Log& log,
                                                 const SessionOptions& options = {});
  virtual ~Session() = default;
  /// Works until `stop`. Call once.
  virtual void Run(std::stop_token stop) = 0;

  // For metrics; thread-safe.
  virtual std::uint64_t polls() const = 0;
  virtual std::uint64_t stale() const = 0;
  virtual std::vector<ircp::TopicCount> sent() const = 0;
  virtual const ircp::Reader& reader() const = 0;

  /// Whether the robot is heard, or would be if it spoke. Simulated time waits for that, so that
  /// the first touch does not depend on how soon the network found the robot. Thread-safe.
  virtual bool is_settled() const = 0;
};

}  // namespace exemplar::capture_tactile
