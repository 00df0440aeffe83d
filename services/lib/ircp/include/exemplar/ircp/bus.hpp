#pragma once
// The network as the programs' behaviour sees it: ports only. bus/ implements them over Fast DDS,
// MemoryBus within one process for tests.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/ircp/samples.hpp"

namespace exemplar::ircp {

/// What came with a sample beside its content.
struct Reception {
  std::string writer;  ///< the writer's identity on the network
  Stamp received;      ///< on this machine's clock
};

/// Sends samples of one topic. Fills header.source and header.seq (from 1, without gaps) itself,
/// and header.stamp where it is zero. Thread-safe.
template <class Sample>
class Writer {
 public:
  virtual ~Writer() = default;
  virtual Status Write(Sample sample) = 0;
  virtual std::uint64_t sent() const = 0;
  /// Taps that only look on (RawTapOptions::observer) are none.
  virtual int matched_readers() const = 0;
  /// Waits until all matched reliable readers have acknowledged; false when `timeout` passed first.
  virtual bool WaitForAcknowledgments(Duration timeout) = 0;
};

/// Losses of one writer as this reader saw them.
struct SourceCount {
  std::string source;
  std::uint64_t received = 0;
  std::uint64_t lost = 0;  ///< gaps in seq below the highest one seen
};

/// Receives until destroyed; after the destructor returns the callback is not called any more.
class Reader {
 public:
  virtual ~Reader() = default;
  virtual int matched_writers() const = 0;
  virtual std::vector<SourceCount> counts() const = 0;
  /// Samples that were malformed and did not reach the callback.
  virtual std::uint64_t refused() const { return 0; }
};

/// Called on a thread of the network: copy and return.
template <class Sample>
using Callback = std::function<void(const Sample&, const Reception&)>;

template <class Sample>
class TopicPort {
 public:
  virtual ~TopicPort() = default;
  /// `topic` for the topics that are named at run time (command, status), else the sample's own.
  virtual Result<std::unique_ptr<Writer<Sample>>> DoMakeWriter(std::type_identity<Sample>,
                                                               const std::string& topic,
                                                               const std::string& source) = 0;
  virtual Result<std::unique_ptr<Reader>> DoMakeReader(std::type_identity<Sample>,
                                                       const std::string& topic,
                                                       Callback<Sample> callback) = 0;
};

/// All topics of one station.
class Bus : public TopicPort<SuitSample>,
            public TopicPort<EndEffectorSample>,
            public TopicPort<TactileSample>,
            public TopicPort<CameraSample>,
            public TopicPort<ObjectSample>,
            public TopicPort<JointStateSample>,
            public TopicPort<JointCommandSample>,
            public TopicPort<PlanSample>,
            public TopicPort<CommandSample>,
            public TopicPort<StatusSample>,
            public TopicPort<SafetySample>,
            public TopicPort<ClockSample> {
 public:
  template <class Sample>
  Result<std::unique_ptr<Writer<Sample>>> MakeWriter(const std::string& source) {
    return MakeWriterOn<Sample>(Sample::kTopic, source);
  }
  template <class Sample>
  Result<std::unique_ptr<Writer<Sample>>> MakeWriterOn(const std::string& topic,
                                                       const std::string& source) {
    return static_cast<TopicPort<Sample>&>(*this).DoMakeWriter({}, topic, source);
  }
  template <class Sample>
  Result<std::unique_ptr<Reader>> MakeReader(Callback<Sample> callback) {
    return MakeReaderOn<Sample>(Sample::kTopic, std::move(callback));
  }
  template <class Sample>
  Result<std::unique_ptr<Reader>> MakeReaderOn(const std::string& topic,
                                               Callback<Sample> callback) {
    return static_cast<TopicPort<Sample>&>(*this).DoMakeReader({}, topic, std::move(callback));
  }
};

// ---- The raw side: any topic, its bytes untouched (the recorder, the gateway). ----

/// An endpoint's identity on the network: its participant's in the first twelve bytes.
using Guid = std::array<std::uint8_t, 16>;

struct RawTopic {
  std::string topic;
  std::string type;    ///< the type's name on the network
  std::string schema;  ///< flattened IDL from the writer's user_data, or empty
  std::string partition;
  bool keyed = false;
  bool reliable = false;
  bool transient_local = false;
  Duration deadline{0};  ///< that the writer offers; 0: none
  /// Of a writer: this many of the last samples are kept for readers that are behind, and nobody
  /// waits for them; 0: all are.
  int keep_last = 0;
};

struct RawSample {
  std::string topic;
  std::string writer;          ///< GUID
  std::uint64_t sequence = 0;  ///< the protocol's number for the writer
  Stamp source_stamp;          ///< as the writer's middleware stamped it
  Stamp received;
  std::vector<std::uint8_t> cdr;  ///< with its 4-byte encapsulation header
  bool valid = true;              ///< false: a dispose or unregister, which uses up a number
};

/// Discovers the station's topics and reads those that `wanted` accepts.
class RawTap {
 public:
  virtual ~RawTap() = default;
  virtual std::vector<RawTopic> topics() const = 0;
  /// Writers matched on `topic`.
  virtual int matched_writers(const std::string& topic) const = 0;
  /// Of the tap's readers of `topic`; none where there is no network.
  virtual std::vector<Guid> reader_guids(const std::string& topic) const {
    (void)topic;
    return {};
  }
};

struct RawTapOptions {
  std::function<bool(const RawTopic&)> wanted = [](const RawTopic&) { return true; };
  std::function<void(const RawTopic&)> on_topic = [](const RawTopic&) {};
  std::function<void(RawSample&&)> on_sample = [](RawSample&&) {};  ///< on a network thread
  /// Looks on: writers do not count it among their matched_readers, so that a program which waits
  /// for its readers does not begin for it.
  bool observer = false;
};

class RawBus {
 public:
  virtual ~RawBus() = default;
  virtual Result<std::unique_ptr<RawTap>> MakeTap(RawTapOptions options) = 0;
};

}  // namespace exemplar::ircp
