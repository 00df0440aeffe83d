#pragma once
// The sending half of the raw side: bytes go out as somebody else serialised them (a replay).

#include <cstdint>
#include <memory>
#include <span>

#include "exemplar/ircp/bus.hpp"

namespace exemplar::ircp {

/// Thread-safe.
class RawWriter {
 public:
  virtual ~RawWriter() = default;
  /// `cdr` with its encapsulation header. Readers get `source_stamp` as the sample's source time,
  /// beside the time at which they received it.
  virtual Status Write(std::span<const std::uint8_t> cdr, Stamp source_stamp) = 0;
  virtual int matched_readers() const = 0;
  /// Waits until all matched reliable readers have acknowledged; false when `timeout` passed first.
  virtual bool WaitForAcknowledgments(Duration timeout) = 0;
  /// Zeros where there is no network.
  virtual Guid guid() const { return {}; }
};

class RawOutlet {
 public:
  virtual ~RawOutlet() = default;
  /// A writer that offers what `topic` says, in the outlet's own station; topics of ours get the
  /// depths of their row in the table of qualities. The schema travels as the original's did.
  virtual Result<std::unique_ptr<RawWriter>> MakeRawWriter(const RawTopic& topic) = 0;
};

}  // namespace exemplar::ircp
