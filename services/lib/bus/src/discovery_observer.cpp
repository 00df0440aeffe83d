#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>

#include <map>
#include <mutex>
#include <sstream>
#include <utility>

#include "exemplar/bus/discovery.hpp"
#include "exemplar/ircp/clock_relation.hpp"
#include "fastdds_parts.hpp"
#include "rtps_names.hpp"

namespace exemplar::bus {
namespace {

using ircp::SeenEndpoint;
using ircp::SeenParticipant;

/// 0 for "never".
Duration FromDds(const eprosima::fastrtps::Duration_t& duration) {
  if (duration == eprosima::fastrtps::c_TimeInfinite) return Duration(0);
  return std::chrono::seconds(duration.seconds) + Duration(duration.nanosec);
}

ircp::SeenLocator ToSeen(const rtps::Locator_t& locator) {
  return LocatorFrom(locator.kind, locator.port,
                     std::span<const std::uint8_t, 16>(locator.address));
}

std::string IdOf(const rtps::GUID_t& guid) { return ircp::ParticipantOf(ToText(guid)); }

/// Of WriterQos and ReaderQos, whose members have the same names.
template <class Qos>
ircp::EndpointQos ToSeen(const Qos& qos) {
  ircp::EndpointQos seen{
      .reliable = qos.m_reliability.kind == dds::RELIABLE_RELIABILITY_QOS,
      .durability = static_cast<int>(qos.m_durability.kind),
      .deadline = FromDds(qos.m_deadline.period),
      .latency_budget = FromDds(qos.m_latencyBudget.duration),
      .exclusive_ownership = qos.m_ownership.kind == dds::EXCLUSIVE_OWNERSHIP_QOS,
      .liveliness = static_cast<int>(qos.m_liveliness.kind),
      .liveliness_lease = FromDds(qos.m_liveliness.lease_duration),
      .ordered_by_source =
          qos.m_destinationOrder.kind == dds::BY_SOURCE_TIMESTAMP_DESTINATIONORDER_QOS,
      .access_scope = static_cast<int>(qos.m_presentation.access_scope),
      .coherent_access = qos.m_presentation.coherent_access,
      .ordered_access = qos.m_presentation.ordered_access};
  for (const auto id : qos.representation.m_value) {
    seen.representations.push_back(static_cast<int>(id));
  }
  return seen;
}

template <class ProxyData>
SeenEndpoint ToSeenEndpoint(ProxyData& data, int domain, bool writer) {
  const std::vector<rtps::octet>& user_data = data.m_qos.m_userData.data_vec();
  SeenEndpoint seen{.id = ToText(data.guid()),
                    .participant = IdOf(data.guid()),
                    .domain = domain,
                    .writer = writer,
                    .topic = data.topicName().to_string(),
                    .type = data.typeName().to_string(),
                    .schema = SchemaFrom(user_data),
                    .keyed = data.topicKind() == rtps::WITH_KEY,
                    .qos = ToSeen(data.m_qos)};
  for (const std::string& name : data.m_qos.m_partition.names()) seen.partitions.push_back(name);
  return seen;
}

class Observer final : public DiscoveryObserver, private dds::DomainParticipantListener {
 public:
  explicit Observer(int domain) : domain_(domain) {}

  /// Once, before anything else.
  Status Start(const ParticipantOptions& options) {
    Result<ParticipantPtr> participant = MakeDdsParticipant(options, Part::kReadsAll, this);
    if (!participant.ok()) return participant.error();
    participant_ = std::move(*participant);
    return {};
  }

  ~Observer() override {
    if (participant_ != nullptr) participant_->set_listener(nullptr);
    participant_.reset();
  }

  ircp::Discovery Now() const override {
    const std::lock_guard lock(mutex_);
    ircp::Discovery now;
    for (const auto& entry : participants_) {
      now.participants.push_back(entry.second);
      const auto trust = trust_.find(entry.first);
      if (trust != trust_.end()) now.participants.back().trust = trust->second;
    }
    for (const auto& entry : endpoints_) now.endpoints.push_back(entry.second);
    return now;
  }

 private:
  void on_participant_discovery(dds::DomainParticipant*,
                                rtps::ParticipantDiscoveryInfo&& info) override {
    const std::string id = IdOf(info.info.m_guid);
    const std::lock_guard lock(mutex_);
    if (info.status == rtps::ParticipantDiscoveryInfo::REMOVED_PARTICIPANT ||
        info.status == rtps::ParticipantDiscoveryInfo::DROPPED_PARTICIPANT) {
      participants_.erase(id);
      std::erase_if(endpoints_, [&](const auto& entry) { return entry.second.participant == id; });
      return;
    }
    SeenParticipant seen{.id = id,
                         .name = info.info.m_participantName.to_string(),
                         .domain = domain_,
                         .vendor = VendorName(info.info.m_VendorId[0], info.info.m_VendorId[1])};
    for (const auto& property : info.info.m_properties) {
      seen.properties[property.first()] = property.second();
    }
#if HAVE_SECURITY
    seen.secured = !info.info.identity_token_.class_id().empty();
#endif
    for (const auto* locators :
         {&info.info.metatraffic_locators.unicast, &info.info.default_locators.unicast}) {
      for (const rtps::Locator_t& locator : *locators) seen.locators.push_back(ToSeen(locator));
    }
    participants_[id] = std::move(seen);
  }

#if HAVE_SECURITY
  void onParticipantAuthentication(dds::DomainParticipant*,
                                   rtps::ParticipantAuthenticationInfo&& info) override {
    const std::lock_guard lock(mutex_);
    trust_[IdOf(info.guid)] =
        info.status == rtps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT
            ? SeenParticipant::Trust::kTrusted
            : SeenParticipant::Trust::kRefused;
  }
#endif

  void on_publisher_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) override {
    Keep(ToSeenEndpoint(info.info, domain_, true),
         info.status != rtps::WriterDiscoveryInfo::REMOVED_WRITER);
  }
  void on_subscriber_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryInfo&& info) override {
    Keep(ToSeenEndpoint(info.info, domain_, false),
         info.status != rtps::ReaderDiscoveryInfo::REMOVED_READER);
  }
  void Keep(SeenEndpoint endpoint, bool there) {
    const std::lock_guard lock(mutex_);
    if (there) {
      endpoints_[endpoint.id] = std::move(endpoint);
    } else {
      endpoints_.erase(endpoint.id);
    }
  }

  const int domain_;
  ParticipantPtr participant_;
  mutable std::mutex mutex_;  ///< guards the three below; never held while Fast DDS is called
  std::map<std::string, SeenParticipant> participants_;
  std::map<std::string, SeenParticipant::Trust> trust_;
  std::map<std::string, SeenEndpoint> endpoints_;
};

}  // namespace

Result<std::unique_ptr<DiscoveryObserver>> DiscoveryObserver::Create(ParticipantOptions options) {
  auto observer = std::make_unique<Observer>(options.domain);
  if (Status started = observer->Start(options); !started.ok()) return started.error();
  return std::unique_ptr<DiscoveryObserver>(std::move(observer));
}

}  // namespace exemplar::bus
