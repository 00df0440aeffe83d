#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>

#include <algorithm>
#include <compare>
#include <condition_variable>
#include <deque>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/SubscriberQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <map>
#include <optional>
#include <thread>
#include <utility>

#include "byte_endpoints.hpp"
#include "exemplar/base/log.hpp"
#include "fastdds_parts.hpp"
#include "rtps_names.hpp"

namespace exemplar::bus {
namespace {

using ircp::RawSample;
using ircp::RawTap;
using ircp::RawTapOptions;
using ircp::RawTopic;

// As much as may wait between the network and the callback; the callback copies and returns.
constexpr int kMaxSamples = 100000;

/// What a reader must match to take all that a writer offers: one reader for each kind, since a
/// reliable one takes nothing from best-effort writers, and a late one wants the last samples only
/// where they are kept.
struct Kind {
  bool reliable = false;
  bool transient_local = false;
  friend auto operator<=>(const Kind&, const Kind&) = default;
};

/// The partition of writers that name none, as other middlewares' do by default.
constexpr const char* kNoPartition = "";

/// What discovery says of one writer.
struct Discovered {
  RawTopic topic;
  Kind kind;
};

/// 0 where the writer promises none.
Duration DeadlineFrom(const eprosima::fastrtps::Duration_t& period) {
  if (period == eprosima::fastrtps::c_TimeInfinite) return Duration(0);
  return std::chrono::seconds(period.seconds) + Duration(period.nanosec);
}

class Tap final : public RawTap, private dds::DomainParticipantListener {
 public:
  Tap(RawTapOptions options, std::string station, const Clock& clock, Log& log)
      : options_(std::move(options)), station_(std::move(station)), clock_(clock), log_(log) {}

  /// Once, before anything else.
  Status Start(const ParticipantOptions& options) {
    Result<ParticipantPtr> participant =
        MakeDdsParticipant(options, options_.observer ? Part::kLooksOn : Part::kReadsAll, this);
    if (!participant.ok()) return participant.error();
    for (const std::string& partition : {station_, std::string(kNoPartition)}) {
      dds::SubscriberQos qos;
      if (!partition.empty()) qos.partition().push_back(partition.c_str());
      dds::Subscriber* subscriber = (*participant)->create_subscriber(qos);
      if (subscriber == nullptr) return Internal("Fast DDS made no subscriber");
      subscribers_[partition] = subscriber;
    }
    participant_ = std::move(*participant);
    worker_ = std::jthread([this](std::stop_token stop) { Work(std::move(stop)); });
    return {};
  }

  ~Tap() override {
    worker_ = {};
    for (const auto& entry : readers_) entry.second.gate->Close();
    if (participant_ != nullptr) participant_->set_listener(nullptr);
    participant_.reset();
  }

  std::vector<RawTopic> topics() const override {
    const std::lock_guard lock(mutex_);
    std::vector<RawTopic> topics;
    for (const auto& entry : topics_) topics.push_back(entry.second);
    return topics;
  }

  int matched_writers(const std::string& topic) const override {
    // A best-effort reader matches the writers of the others, too.
    int count = 0;
    for (dds::DataReader* reader : ReadersOf(topic)) {
      dds::SubscriptionMatchedStatus status;
      reader->get_subscription_matched_status(status);
      count = std::max(count, status.current_count);
    }
    return count;
  }

  std::vector<ircp::Guid> reader_guids(const std::string& topic) const override {
    std::vector<ircp::Guid> guids;
    for (dds::DataReader* reader : ReadersOf(topic)) guids.push_back(ToGuid(reader->guid()));
    return guids;
  }

 private:
  std::vector<dds::DataReader*> ReadersOf(const std::string& topic) const {
    std::vector<dds::DataReader*> readers;
    const std::lock_guard lock(mutex_);
    for (const auto& [key, entry] : readers_) {
      if (key.topic == topic) readers.push_back(entry.reader);
    }
    return readers;
  }

  struct TopicReader {
    std::unique_ptr<ArrivalGate> gate;
    dds::DataReader* reader = nullptr;
  };
  struct ReaderKey {
    std::string topic;
    std::string partition;
    Kind kind;
    friend auto operator<=>(const ReaderKey&, const ReaderKey&) = default;
  };

  /// Where the writer is to be read; nullopt for those that are none of ours: of another station,
  /// or with our topics' names outside of every station.
  std::optional<std::string> PartitionOf(const std::vector<std::string>& names,
                                         const std::string& topic) const {
    if (std::find(names.begin(), names.end(), station_) != names.end()) return station_;
    const bool without = names.empty() || std::find(names.begin(), names.end(), "") != names.end();
    if (!without || topic.starts_with("ircp/")) return std::nullopt;
    return kNoPartition;
  }

  // On a thread of the network: only notes what happened.
  void on_publisher_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) override {
    const auto& qos = info.info.m_qos;
    const std::string topic = info.info.topicName().to_string();
    const std::optional<std::string> partition = PartitionOf(qos.m_partition.names(), topic);
    if (!partition) return;
    const std::string writer = ToText(info.info.guid());
    const Kind kind{
        .reliable = qos.m_reliability.kind == dds::RELIABLE_RELIABILITY_QOS,
        .transient_local = qos.m_durability.kind >= dds::TRANSIENT_LOCAL_DURABILITY_QOS};

    const std::lock_guard lock(mutex_);
    if (info.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER) return;
    writer_kinds_[writer] = kind;
    queue_.push_back({.topic = {.topic = topic,
                                .type = info.info.typeName().to_string(),
                                .schema = SchemaFrom(qos.m_userData.data_vec()),
                                .partition = *partition,
                                .keyed = info.info.topicKind() == rtps::WITH_KEY,
                                .reliable = kind.reliable,
                                .transient_local = kind.transient_local,
                                .deadline = DeadlineFrom(qos.m_deadline.period)},
                      .kind = kind});
    queued_.notify_one();
  }

  // Makes readers outside the discovery callback, which holds Fast DDS's locks.
  void Work(std::stop_token stop) {
    std::unique_lock lock(mutex_);
    while (queued_.wait(lock, stop, [this] { return !queue_.empty(); })) {
      const Discovered found = std::move(queue_.front());
      queue_.pop_front();
      const bool is_new = topics_.try_emplace(found.topic.topic, found.topic).second;
      const RawTopic known = topics_[found.topic.topic];
      lock.unlock();
      if (known.type != found.topic.type) {
        log_.Warning("writer ignored", {{"topic", known.topic},
                                        {"type", found.topic.type},
                                        {"because", "the topic carries " + known.type}});
      } else {
        if (is_new) options_.on_topic(known);
        if (options_.wanted(found.topic)) Follow(found);
      }
      lock.lock();
    }
  }

  void Follow(const Discovered& found) {
    const ReaderKey key{found.topic.topic, found.topic.partition, found.kind};
    {
      const std::lock_guard lock(mutex_);
      if (readers_.count(key) != 0) return;
    }
    dds::Topic*& topic = dds_topics_[found.topic.topic];
    if (topic == nullptr) {
      Result<dds::Topic*> made =
          MakeTopic(*participant_, found.topic.topic, found.topic.type, found.topic.keyed);
      if (!made.ok()) {
        log_.Warning("topic not read", {{"topic", key.topic}, {"error", made.error().message}});
        return;
      }
      topic = *made;
    }
    TopicReader entry;
    entry.gate = std::make_unique<ArrivalGate>(clock_, [this, key](Arrival&& arrival) {
      HandOn(key.topic, key.kind, std::move(arrival));
    });
    entry.reader =
        subscribers_.at(key.partition)
            ->create_datareader(
                topic, ReaderQos(found.kind.reliable, found.kind.transient_local, kMaxSamples),
                entry.gate.get(), dds::StatusMask::data_available());
    if (entry.reader == nullptr) {
      log_.Warning("topic not read", {{"topic", key.topic}, {"error", "Fast DDS refused"}});
      return;
    }
    const std::lock_guard lock(mutex_);
    readers_.emplace(key, std::move(entry));
  }

  void HandOn(const std::string& topic, Kind kind, Arrival&& arrival) {
    {
      // What another reader of the topic takes from this writer, too, is taken there.
      const std::lock_guard lock(mutex_);
      const auto known = writer_kinds_.find(arrival.writer);
      if (known != writer_kinds_.end() && known->second != kind) return;
    }
    options_.on_sample({.topic = topic,
                        .writer = std::move(arrival.writer),
                        .sequence = arrival.sequence,
                        .source_stamp = arrival.source_stamp,
                        .received = arrival.received,
                        .cdr = std::move(arrival.cdr),
                        .valid = arrival.valid});
  }

  const RawTapOptions options_;
  const std::string station_;
  const Clock& clock_;
  Log& log_;
  ParticipantPtr participant_;
  std::map<std::string, dds::Subscriber*> subscribers_;  ///< by partition; fixed after Start

  mutable std::mutex mutex_;  ///< guards the five below; never held while Fast DDS is called
  std::condition_variable_any queued_;
  std::deque<Discovered> queue_;
  std::map<std::string, RawTopic> topics_;
  std::map<std::string, Kind> writer_kinds_;
  std::map<ReaderKey, TopicReader> readers_;

  std::map<std::string, dds::Topic*> dds_topics_;  ///< of the worker alone
  std::jthread worker_;
};

}  // namespace

Result<std::unique_ptr<RawTap>> MakeRawTap(const ParticipantOptions& options,
                                           RawTapOptions tap_options) {
  ParticipantOptions own = options;
  own.name += "-tap";
  auto tap = std::make_unique<Tap>(std::move(tap_options),
                                   own.without_station ? std::string() : own.station, *own.clock,
                                   *own.log);
  if (Status started = tap->Start(own); !started.ok()) return started.error();
  return std::unique_ptr<RawTap>(std::move(tap));
}

}  // namespace exemplar::bus
