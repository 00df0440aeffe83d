#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/publisher/qos/PublisherQos.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/SubscriberQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <utility>

#include "byte_endpoints.hpp"
#include "fastdds_parts.hpp"

namespace exemplar::bus {
namespace {

using eprosima::fastrtps::Duration_t;

constexpr std::chrono::seconds kLastWordsTimeout{2};
/// Of a writer that keeps all: a reader may be so far behind.
constexpr std::chrono::seconds kLongestBlocking{10};

Duration_t ToDds(Duration d) {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(d);
  return Duration_t(static_cast<std::int32_t>(seconds.count()),
                    static_cast<std::uint32_t>((d - seconds).count()));
}

dds::DataWriterQos WriterQos(const TopicQos& row, std::string_view schema) {
  dds::DataWriterQos qos;
  qos.reliability().kind =
      row.reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind =
      row.transient_local ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = row.depth;
  if (row.keep_all) {
    qos.history().kind = dds::KEEP_ALL_HISTORY_QOS;
    qos.reliability().max_blocking_time = ToDds(kLongestBlocking);
  }
  dds::ResourceLimitsQosPolicy& limits = qos.resource_limits();
  limits.max_instances = row.max_instances;
  limits.max_samples_per_instance = row.depth;
  limits.max_samples = row.depth * row.max_instances;
  limits.allocated_samples = 16;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos.data_sharing().off();
  qos.reliable_writer_qos().times.heartbeatPeriod = ToDds(row.heartbeat);
  if (row.deadline.count() > 0) qos.deadline().period = ToDds(row.deadline);
  qos.publish_mode().kind =
      row.asynchronous ? dds::ASYNCHRONOUS_PUBLISH_MODE : dds::SYNCHRONOUS_PUBLISH_MODE;
  qos.user_data().setValue(std::vector<rtps::octet>(schema.begin(), schema.end()));
  return qos;
}

class DdsWriter final : public ByteWriter {
 public:
  /// `readers` is the listener of `writer`.
  DdsWriter(dds::Publisher& publisher, dds::DataWriter& writer,
            std::unique_ptr<ReaderCount> readers, std::string topic, bool reliable)
      : publisher_(publisher),
        readers_(std::move(readers)),
        writer_(writer),
        topic_(std::move(topic)),
        reliable_(reliable) {}

  ~DdsWriter() override {
    if (reliable_) WaitForAcknowledgments(kLastWordsTimeout);
    // Fast DDS 2.9 releases the samples of a writer that goes one by one beside its heartbeats; one
    // that meets them half released looks for gaps without end, and holds the writer's lock.
    std::size_t removed = 0;
    writer_.clear_history(&removed);
    publisher_.delete_datawriter(&writer_);
  }

  Status Write(Bytes& bytes) override {
    rtps::WriteParams parameters;
    if (bytes.source_stamp) {
      parameters.source_timestamp().from_ns(bytes.source_stamp->nanoseconds());
    }
    if (!writer_.write(&bytes, parameters)) {
      return Error{ErrorCode::kResourceExhausted,
                   "topic " + topic_ + ": Fast DDS did not take a sample of " +
                       std::to_string(bytes.cdr.size()) +
                       " bytes (too many sources, or its readers are far behind)"};
    }
    return {};
  }

  int matched_readers() const override { return readers_->count(); }

  bool WaitForAcknowledgments(Duration timeout) override {
    return writer_.wait_for_acknowledgments(ToDds(timeout)) == ReturnCode_t::RETCODE_OK;
  }

  ircp::Guid guid() const override { return ToGuid(writer_.guid()); }

 private:
  dds::Publisher& publisher_;
  std::unique_ptr<ReaderCount> readers_;
  dds::DataWriter& writer_;
  std::string topic_;
  bool reliable_;
};

class DdsReader final : public ByteReader {
 public:
  /// `gate` is the listener of `reader`.
  DdsReader(dds::Subscriber& subscriber, dds::DataReader& reader, std::unique_ptr<ArrivalGate> gate)
      : subscriber_(subscriber), reader_(reader), gate_(std::move(gate)) {}

  ~DdsReader() override {
    gate_->Close();
    subscriber_.delete_datareader(&reader_);
  }

  int matched_writers() const override {
    dds::SubscriptionMatchedStatus status;
    reader_.get_subscription_matched_status(status);
    return status.current_count;
  }

 private:
  dds::Subscriber& subscriber_;
  dds::DataReader& reader_;
  std::unique_ptr<ArrivalGate> gate_;
};

class Station final : public DdsStation {
 public:
  Station(std::unique_ptr<Onlookers> onlookers, ParticipantPtr participant,
          dds::Publisher& publisher, dds::Subscriber& subscriber, const ParticipantOptions& options)
      : onlookers_(std::move(onlookers)),
        participant_(std::move(participant)),
        publisher_(publisher),
        subscriber_(subscriber),
        clock_(*options.clock),
        security_(options.security) {}
  ~Station() override { participant_->set_listener(nullptr); }

  Result<std::unique_ptr<ByteWriter>> MakeWriter(const std::string& topic, const TypeInfo& type,
                                                 const TopicQos& qos) override {
    Result<dds::Topic*> made = FindOrMakeTopic(topic, type);
    if (!made.ok()) return made.error();
    auto readers = std::make_unique<ReaderCount>(*onlookers_);
    dds::DataWriter* writer = publisher_.create_datawriter(
        *made, WriterQos(qos, type.schema), readers.get(), dds::StatusMask::publication_matched());
    if (writer == nullptr) return Refused(topic, "write");
    return std::unique_ptr<ByteWriter>(
        std::make_unique<DdsWriter>(publisher_, *writer, std::move(readers), topic, qos.reliable));
  }

  Result<std::unique_ptr<ByteReader>> MakeReader(const std::string& topic, const TypeInfo& type,
                                                 const TopicQos& qos,
                                                 OnArrival on_arrival) override {
    Result<dds::Topic*> made = FindOrMakeTopic(topic, type);
    if (!made.ok()) return made.error();
    auto gate = std::make_unique<ArrivalGate>(clock_, std::move(on_arrival));
    dds::DataReader* reader = subscriber_.create_datareader(
        *made, ReaderQos(qos.reliable, qos.transient_local, qos.depth * qos.max_instances),
        gate.get(), dds::StatusMask::data_available());
    if (reader == nullptr) return Refused(topic, "read");
    return std::unique_ptr<ByteReader>(
        std::make_unique<DdsReader>(subscriber_, *reader, std::move(gate)));
  }

 private:
  Error Refused(const std::string& topic, const char* verb) const {
    if (security_.empty()) {
      return Internal("topic " + topic + ": Fast DDS lets nobody " + verb + " it");
    }
    return FailedPrecondition("topic " + topic + ": the permissions in " + security_ +
                                  " do not let this program " + verb +
                                  " it; `exemplar security issue` gives others by role",
                              "security");
  }

  Result<dds::Topic*> FindOrMakeTopic(const std::string& topic, const TypeInfo& type) {
    const std::lock_guard lock(mutex_);
    const std::string type_name(type.name);
    const auto known = topics_.find(topic);
    if (known == topics_.end()) {
      Result<dds::Topic*> made = MakeTopic(*participant_, topic, type_name, type.keyed);
      if (made.ok()) topics_[topic] = *made;
      return made;
    }
    if (known->second->get_type_name() != type_name) {
      return InvalidArgument("topic " + topic + " carries " + known->second->get_type_name() +
                             ", not " + type_name);
    }
    return known->second;
  }

  const std::unique_ptr<Onlookers> onlookers_;  ///< the participant's listener
  ParticipantPtr participant_;
  dds::Publisher& publisher_;
  dds::Subscriber& subscriber_;
  const Clock& clock_;
  const std::string security_;
  std::mutex mutex_;
  std::map<std::string, dds::Topic*> topics_;
};

}  // namespace

Result<std::unique_ptr<DdsStation>> DdsStation::Create(const ParticipantOptions& options) {
  auto onlookers = std::make_unique<Onlookers>();
  Result<ParticipantPtr> participant =
      MakeDdsParticipant(options, Part::kTakesPart, onlookers.get());
  if (!participant.ok()) return participant.error();
  dds::PublisherQos publisher_qos;
  dds::SubscriberQos subscriber_qos;
  if (!options.without_station) {
    publisher_qos.partition().push_back(options.station.c_str());
    subscriber_qos.partition().push_back(options.station.c_str());
  }
  dds::Publisher* publisher = (*participant)->create_publisher(publisher_qos);
  dds::Subscriber* subscriber = (*participant)->create_subscriber(subscriber_qos);
  if (publisher == nullptr || subscriber == nullptr) {
    return Internal("Fast DDS made no publisher or subscriber");
  }
  return std::unique_ptr<DdsStation>(std::make_unique<Station>(
      std::move(onlookers), std::move(*participant), *publisher, *subscriber, options));
}

}  // namespace exemplar::bus
