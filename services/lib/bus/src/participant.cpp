#include "exemplar/bus/participant.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <utility>

#include "byte_endpoints.hpp"
#include "exemplar/bus/codec.hpp"
#include "exemplar/bus/qos_table.hpp"
#include "exemplar/ircp/bus_of.hpp"
#include "exemplar/ircp/check.hpp"
#include "exemplar/ircp/sequence_set.hpp"
#include "refusals.hpp"

namespace exemplar::bus {
namespace {

template <class Sample>
TypeInfo TypeInfoOf() {
  return {.name = TypeNameOf<Sample>(), .schema = SchemaOf<Sample>()};
}

template <class Sample>
const TopicQos& QosOf() {
  const std::string_view name = TypeNameOf<Sample>();
  return QosOfType(name.substr(name.rfind(':') + 1));
}

template <class Sample>
class SampleWriter final : public ircp::Writer<Sample> {
 public:
  SampleWriter(std::unique_ptr<ByteWriter> writer, std::string source, const Clock& clock,
               bool stamps_all)
      : writer_(std::move(writer)),
        source_(std::move(source)),
        clock_(clock),
        stamps_all_(stamps_all) {}

  Status Write(Sample sample) override {
    sample.header.source = source_;
    if (sample.header.stamp == Stamp()) sample.header.stamp = clock_.Now();
    if (Status checked = ircp::Check(sample); !checked.ok()) {
      return WithPlace(checked.error(), TypeNameOf<Sample>());
    }
    const std::lock_guard lock(mutex_);
    sample.header.seq = sent_ + 1;
    Bytes bytes{.cdr = Encode(sample), .key = KeyHashOf(sample)};
    if (stamps_all_) bytes.source_stamp = clock_.Now();
    Status written = writer_->Write(bytes);
    if (written.ok()) ++sent_;
    return written;
  }

  std::uint64_t sent() const override {
    const std::lock_guard lock(mutex_);
    return sent_;
  }
  int matched_readers() const override { return writer_->matched_readers(); }
  bool WaitForAcknowledgments(Duration timeout) override {
    return writer_->WaitForAcknowledgments(timeout);
  }

 private:
  std::unique_ptr<ByteWriter> writer_;
  const std::string source_;
  const Clock& clock_;
  const bool stamps_all_;
  mutable std::mutex mutex_;  ///< numbers go out in order
  std::uint64_t sent_ = 0;
};

/// Counts what came from each writer, by its own numbers.
class Tally {
 public:
  void Add(const std::string& writer, const ircp::Header& header) {
    const std::lock_guard lock(mutex_);
    writers_[{header.source, writer}].Insert(header.seq);
  }

  /// Summed over the writers of a source: one that was started again is a new writer.
  std::vector<ircp::SourceCount> counts() const {
    const std::lock_guard lock(mutex_);
    std::vector<ircp::SourceCount> counts;
    for (const auto& [who, numbers] : writers_) {
      if (counts.empty() || counts.back().source != who.first) {
        counts.push_back({.source = who.first});
      }
      counts.back().received += numbers.received();
      counts.back().lost += numbers.lost();
    }
    return counts;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::pair<std::string, std::string>, ircp::SequenceSet> writers_;
};

class SampleReader final : public ircp::Reader {
 public:
  /// `reader` feeds `tally` and `refusals`.
  SampleReader(std::unique_ptr<ByteReader> reader, std::shared_ptr<Tally> tally,
               std::shared_ptr<Refusals> refusals)
      : tally_(std::move(tally)), refusals_(std::move(refusals)), reader_(std::move(reader)) {}
  int matched_writers() const override { return reader_->matched_writers(); }
  std::vector<ircp::SourceCount> counts() const override { return tally_->counts(); }
  std::uint64_t refused() const override { return refusals_->total(); }

 private:
  // Shared with the callback of reader_.
  std::shared_ptr<Tally> tally_;
  std::shared_ptr<Refusals> refusals_;
  std::unique_ptr<ByteReader> reader_;
};

class DdsParticipant final : public ircp::BusOf<DdsParticipant, Participant> {
 public:
  DdsParticipant(ParticipantOptions options, std::unique_ptr<DdsStation> station)
      : options_(std::move(options)), station_(std::move(station)) {}

  template <class Sample>
  Result<std::unique_ptr<ircp::Writer<Sample>>> OpenWriter(const std::string& topic,
                                                           const std::string& source) {
    if (source.empty() || source.size() > ircp::kMaxKeyBytes) {
      return InvalidArgument(
          "topic " + topic + ": source \"" + source + "\" must have 1 to 255 bytes", "source");
    }
    Result<std::unique_ptr<ByteWriter>> writer =
        station_->MakeWriter(topic, TypeInfoOf<Sample>(), QosFor<Sample>(topic));
    if (!writer.ok()) return writer.error();
    return std::unique_ptr<ircp::Writer<Sample>>(std::make_unique<SampleWriter<Sample>>(
        std::move(*writer), source, *options_.clock, options_.stamps_all));
  }

  template <class Sample>
  Result<std::unique_ptr<ircp::Reader>> OpenReader(const std::string& topic,
                                                   ircp::Callback<Sample> callback) {
    auto tally = std::make_shared<Tally>();
    auto refusals = std::make_shared<Refusals>(topic, *options_.clock, *options_.log);
    auto on_arrival = [tally, refusals, callback = std::move(callback)](Arrival&& arrival) {
      if (!arrival.valid) return;
      Result<Sample> sample = Decode<Sample>(arrival.cdr);
      if (!sample.ok()) {
        refusals->Add(arrival.writer, sample.error().message);
        return;
      }
      refusals->Tick();
      tally->Add(arrival.writer, sample->header);
      callback(*sample, {.writer = std::move(arrival.writer), .received = arrival.received});
    };
    Result<std::unique_ptr<ByteReader>> reader = station_->MakeReader(
        topic, TypeInfoOf<Sample>(), QosFor<Sample>(topic), std::move(on_arrival));
    if (!reader.ok()) return reader.error();
    return std::unique_ptr<ircp::Reader>(
        std::make_unique<SampleReader>(std::move(*reader), std::move(tally), std::move(refusals)));
  }

  Result<std::unique_ptr<ircp::RawTap>> MakeTap(ircp::RawTapOptions tap_options) override {
    return MakeRawTap(options_, std::move(tap_options));
  }

  Result<std::unique_ptr<ircp::RawWriter>> MakeRawWriter(const ircp::RawTopic& topic) override {
    return OpenRawWriter(*station_, topic);
  }

 private:
  template <class Sample>
  TopicQos QosFor(const std::string& topic) const {
    TopicQos qos = QosOf<Sample>();
    const std::vector<std::string>& best_effort = options_.best_effort_topics;
    if (std::find(best_effort.begin(), best_effort.end(), topic) != best_effort.end()) {
      qos.reliable = false;
    }
    return qos;
  }

  ParticipantOptions options_;  ///< clock and log are set
  std::unique_ptr<DdsStation> station_;
};

}  // namespace

Result<std::unique_ptr<Participant>> Participant::Create(ParticipantOptions options) {
  static const SystemClock system_clock;
  static NullLog null_log;
  if (options.clock == nullptr) options.clock = &system_clock;
  if (options.log == nullptr) options.log = &null_log;
  Result<std::unique_ptr<DdsStation>> station = DdsStation::Create(options);
  if (!station.ok()) return station.error();
  return std::unique_ptr<Participant>(
      std::make_unique<DdsParticipant>(std::move(options), std::move(*station)));
}

}  // namespace exemplar::bus
