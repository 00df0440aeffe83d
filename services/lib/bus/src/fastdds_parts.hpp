#pragma once
// What writers, readers and the raw tap share of Fast DDS.

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "byte_endpoints.hpp"
#include "revocation_watch.hpp"

namespace exemplar::bus {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::types::ReturnCode_t;

/// Carries Bytes under any type's name. Readers see all samples as one instance, so that these come
/// out in the order in which they arrived; writers tell the true instance by Bytes::key.
class BytesType final : public dds::TopicDataType {
 public:
  BytesType(const std::string& type_name, bool keyed);
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override;
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override;
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override;
  void* createData() override;
  void deleteData(void* data) override;
  bool getKey(void* data, rtps::InstanceHandle_t* handle, bool force_md5) override;
};

/// Deletes a participant with all that it holds.
struct ParticipantDeleter {
  void operator()(dds::DomainParticipant* participant) const;
  std::shared_ptr<RevocationWatch> watch = {};  ///< of a secured one
};
using ParticipantPtr = std::unique_ptr<dds::DomainParticipant, ParticipantDeleter>;

/// What a participant is there for.
enum class Part {
  kTakesPart,
  kReadsAll,  ///< is told by a discovery server of all endpoints, not only of those that match its
  kLooksOn,   ///< the same, and its readers do not count (ReaderCount)
};

/// `listener` may be null; it outlives the participant.
Result<ParticipantPtr> MakeDdsParticipant(const ParticipantOptions& options, Part part,
                                          dds::DomainParticipantListener* listener);

/// Registers BytesType under the type's name and creates the topic.
Result<dds::Topic*> MakeTopic(dds::DomainParticipant& participant, const std::string& topic,
                              const std::string& type_name, bool keyed);

/// QoS of a reader that loses nothing that its writers keep: KEEP_ALL, and no data sharing.
dds::DataReaderQos ReaderQos(bool reliable, bool transient_local, int max_samples);

std::string ToText(const rtps::GUID_t& guid);
ircp::Guid ToGuid(const rtps::GUID_t& guid);
Stamp ToStamp(const rtps::Time_t& time);

/// Notes which participants only look on. Thread-safe.
class Onlookers final : public dds::DomainParticipantListener {
 public:
  bool Has(const rtps::GuidPrefix_t& participant) const;
  void on_participant_discovery(dds::DomainParticipant* participant,
                                rtps::ParticipantDiscoveryInfo&& info) override;

 private:
  mutable std::mutex mutex_;  ///< never held while Fast DDS is called
  std::set<rtps::GuidPrefix_t> found_;
};

/// Counts a writer's readers, but those of onlookers. Thread-safe.
class ReaderCount final : public dds::DataWriterListener {
 public:
  /// `onlookers` outlives it.
  explicit ReaderCount(const Onlookers& onlookers) : onlookers_(onlookers) {}
  int count() const;
  void on_publication_matched(dds::DataWriter* writer,
                              const dds::PublicationMatchedStatus& status) override;

 private:
  const Onlookers& onlookers_;
  mutable std::mutex mutex_;  ///< never held while Fast DDS is called
  std::set<rtps::GUID_t> readers_;
};

/// Takes samples and hands them on until closed. Fast DDS calls it on its receiving threads.
class ArrivalGate final : public dds::DataReaderListener {
 public:
  ArrivalGate(const Clock& clock, OnArrival on_arrival);
  /// After its return nothing is handed on any more.
  void Close();
  void on_data_available(dds::DataReader* reader) override;

 private:
  const std::string& WriterName(const rtps::GUID_t& guid);

  const Clock& clock_;
  std::mutex mutex_;
  OnArrival on_arrival_;
  std::map<rtps::GUID_t, std::string> writers_;
};

}  // namespace exemplar::bus
