#pragma once
// Endpoints that carry bytes: what the rest of bus/ sees of Fast DDS, without its headers.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/bus/qos_table.hpp"

namespace exemplar::bus {

/// One sample on its way.
struct Bytes {
  std::vector<std::uint8_t> cdr;        ///< with its encapsulation header
  std::array<std::uint8_t, 16> key{};   ///< of the instance; only writers need it
  std::optional<Stamp> source_stamp{};  ///< for writers: instead of the time of writing
};

/// One sample that came.
struct Arrival {
  std::vector<std::uint8_t> cdr;
  std::string writer;          ///< GUID
  std::uint64_t sequence = 0;  ///< the protocol's
  Stamp source_stamp;
  Stamp received;
  bool valid = true;
};
using OnArrival = std::function<void(Arrival&&)>;

/// What the network has to know of a type.
struct TypeInfo {
  std::string_view name;
  std::string_view schema;  ///< flattened IDL
  bool keyed = true;
};

/// Thread-safe.
class ByteWriter {
 public:
  virtual ~ByteWriter() = default;
  virtual Status Write(Bytes& bytes) = 0;
  virtual int matched_readers() const = 0;
  virtual bool WaitForAcknowledgments(Duration timeout) = 0;
  virtual ircp::Guid guid() const = 0;
};

/// Thread-safe. After its destructor the callback is not called any more.
class ByteReader {
 public:
  virtual ~ByteReader() = default;
  virtual int matched_writers() const = 0;
};

/// A participant of the domain whose topics lie in one partition. Thread-safe; outlives its
/// endpoints.
class DdsStation {
 public:
  static Result<std::unique_ptr<DdsStation>> Create(const ParticipantOptions& options);
  virtual ~DdsStation() = default;
  virtual Result<std::unique_ptr<ByteWriter>> MakeWriter(const std::string& topic,
                                                         const TypeInfo& type,
                                                         const TopicQos& qos) = 0;
  virtual Result<std::unique_ptr<ByteReader>> MakeReader(const std::string& topic,
                                                         const TypeInfo& type, const TopicQos& qos,
                                                         OnArrival on_arrival) = 0;
};

/// Sends bytes as they are under the type's name.
Result<std::unique_ptr<ircp::RawWriter>> OpenRawWriter(DdsStation& station,
                                                       const ircp::RawTopic& topic);

/// The raw side has a participant of its own: a topic has one type support a participant, and the
/// program's own readers hold theirs.
Result<std::unique_ptr<ircp::RawTap>> MakeRawTap(const ParticipantOptions& options,
                                                 ircp::RawTapOptions tap_options);

}  // namespace exemplar::bus
