#include "fastdds_parts.hpp"

#include <arpa/inet.h>
#include <fastdds/rtps/attributes/ServerAttributes.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/attributes/LibrarySettingsAttributes.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/log/StdoutErrConsumer.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <optional>
#include <set>
#include <sstream>

#include "exemplar/base/text.hpp"
#include "exemplar/security/station.hpp"
#include "greeting_guard.hpp"
#include "message_guard.hpp"

namespace exemplar::bus {
namespace {

using eprosima::fastrtps::rtps::IPLocator;
using rtps::Locator_t;

/// The property of participants whose readers do not count.
constexpr const char* kOnlooker = "exemplar.looks_on";
constexpr int kMaxDomain = 232;
constexpr std::size_t kMaxNameBytes = 200;
constexpr std::uint32_t kTypicalSampleBytes = 1024;
constexpr std::uint32_t kSocketBufferBytes = 4 << 20;
// Participants of one machine that are found without multicast.
constexpr std::uint32_t kUnicastPeers = 24;
// A neighbour that is silent this long has gone. Longer than the history's 30 s, so that a link cut
// that long comes back as the same neighbour, and gets what it missed.
constexpr int kLeaseSeconds = 40;
constexpr int kAnnouncementSeconds = 3;

/// Addresses of this machine's interfaces by name.
std::multimap<std::string, std::string> InterfaceAddresses() {
  std::multimap<std::string, std::string> found;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return found;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    sockaddr_in address{};
    std::memcpy(&address, entry->ifa_addr, sizeof(address));
    char text[INET_ADDRSTRLEN] = {};
    inet_ntop(AF_INET, &address.sin_addr, text, sizeof(text));
    found.emplace(entry->ifa_name, text);
  }
  freeifaddrs(list);
  return found;
}

Result<std::vector<std::string>> ResolveInterfaces(const std::vector<std::string>& wanted) {
  std::vector<std::string> addresses;
  if (wanted.empty()) return addresses;
  const std::multimap<std::string, std::string> all = InterfaceAddresses();
  for (const std::string& one : wanted) {
    const std::size_t before = addresses.size();
    for (const auto& [name, address] : all) {
      if (name == one || address == one) addresses.push_back(address);
    }
    if (addresses.size() > before) continue;
    std::set<std::string> names;
    for (const auto& entry : all) names.insert(entry.first);
    return InvalidArgument("interface \"" + one + "\" does not exist here; there are " +
                               Join(std::vector<std::string>(names.begin(), names.end()), ", "),
                           "interfaces");
  }
  return addresses;
}

/// No more than a sixteenth of what /dev/shm has left: containers give it 64 MB, and a program that
/// finds it full later would die of it. None where that would hold no picture, so that a container
/// with a tiny /dev/shm talks UDP only.
std::uint32_t SharedMemoryBytes(std::size_t wanted) {
  constexpr std::size_t kUsefulBytes = std::size_t{1} << 20;
  struct statvfs space {};
  if (wanted == 0 || statvfs("/dev/shm", &space) != 0) return 0;
  const std::size_t free_bytes = std::size_t{space.f_bavail} * space.f_frsize;
  if (free_bytes / 16 < kUsefulBytes) return 0;
  return static_cast<std::uint32_t>(std::min(wanted, free_bytes / 16));
}

Status CheckOptions(const ParticipantOptions& options) {
  if (options.domain < 0 || options.domain > kMaxDomain) {
    return InvalidArgument("domain " + std::to_string(options.domain) + " is not in 0 to " +
                               std::to_string(kMaxDomain),
                           "domain");
  }
  // A partition with wildcards would match every station.
  if (!options.without_station &&
      (options.station.empty() || options.station.size() > kMaxNameBytes ||
       options.station.find_first_of("*?[]") != std::string::npos)) {
    return InvalidArgument(
        "station \"" + options.station + "\" must be 1 to 200 characters without any of * ? [ ]",
        "station");
  }
  if (!options.security.empty() && !options.discovery_servers.empty()) {
    return InvalidArgument(
        "a secured participant cannot use a discovery server: Fast DDS 2.9 aborts or never "
        "matches; "
        "use multicast or peers",
        "discovery-server");
  }
  if (options.name.size() > kMaxNameBytes) {
    return InvalidArgument("participant name \"" + options.name + "\" is longer than 200 bytes",
                           "name");
  }
  return {};
}

Result<rtps::LocatorList_t> InitialPeers(int domain, const std::vector<std::string>& peers) {
  rtps::LocatorList_t list;
  // With port 0, Fast DDS 2.9 would try the group at the unicast ports only.
  Locator_t group;
  IPLocator::createLocator(
      LOCATOR_KIND_UDPv4, "239.255.0.1",
      rtps::PortParameters().getMulticastPort(static_cast<std::uint32_t>(domain)), group);
  list.push_back(group);
  std::vector<std::string> addresses = {"127.0.0.1"};
  addresses.insert(addresses.end(), peers.begin(), peers.end());
  for (const std::string& address : addresses) {
    Locator_t locator;
    locator.kind = LOCATOR_KIND_UDPv4;
    locator.port = 0;  // Fast DDS fills in the ports of the first kUnicastPeers participants
    if (!IPLocator::setIPv4(locator, address)) {
      return InvalidArgument("peer \"" + address + "\" is not an IPv4 address", "peers");
    }
    list.push_back(locator);
  }
  return list;
}

using DiscoveryServers = eprosima::fastdds::rtps::RemoteServerList_t;

Result<DiscoveryServers> FindDiscoveryServers(const std::vector<std::string>& addresses) {
  DiscoveryServers servers;
  for (const std::string& address : addresses) {
    const std::size_t colon = address.rfind(':');
    const std::optional<long long> port =
        colon == std::string::npos ? std::nullopt : ParseInteger(address.substr(colon + 1));
    // Its place in the list tells the server's id, and so its identity on the network.
    DiscoveryServers found;
    const std::string place(servers.size(), ';');
    if (!port || *port < 1 || *port > 65535 || address.find(';') != std::string::npos ||
        !eprosima::fastdds::rtps::load_environment_server_info(place + address, found) ||
        found.size() != 1) {
      return InvalidArgument("discovery server \"" + address + "\" is not the HOST:PORT of a host",
                             "discovery-server");
    }
    servers.push_back(found.front());
  }
  return servers;
}

void WarnOfFolder(const ParticipantOptions& options) {
  if (options.log == nullptr) return;
  for (const std::string& warning :
       security::MemberFolderWarnings(options.security, SystemClock().Now())) {
    options.log->Warning("the identity needs care", {{"what", warning}});
  }
}

/// DDS-Security with the files of a member's folder.
Status Secure(const ParticipantOptions& options, dds::DomainParticipantQos& qos) {
  if (options.security.empty()) return {};
  const Status checked =
      security::CheckMemberFolder(options.security, options.station, SystemClock().Now());
  if (!checked) return checked;
  if (!MessagesAreGuarded()) {
    return FailedPrecondition(
        "--security: this Fast DDS believes messages in another's name, and does not let them be "
        "refused",
        "security");
  }
  WarnOfFolder(options);
  if (!GreetingsAreGuarded() && options.log != nullptr) {
    options.log->Warning("members that start at one moment may never meet",
                         {{"because", "this Fast DDS does not let their greetings be guarded"}});
  }
  const security::MemberFiles files = security::FilesOf(options.security);
  const auto set = [&qos](const std::string& name, const std::string& value) {
    qos.properties().properties().emplace_back("dds.sec." + name, value);
  };
  const auto set_file = [&set](const std::string& name, const std::filesystem::path& file) {
    set(name, "file://" + std::filesystem::absolute(file).string());
  };
  set("auth.plugin", "builtin.PKI-DH");
  set_file("auth.builtin.PKI-DH.identity_ca", files.authority);
  set_file("auth.builtin.PKI-DH.identity_certificate", files.certificate);
  set_file("auth.builtin.PKI-DH.identity_crl", files.revocations);
  set_file("auth.builtin.PKI-DH.private_key", files.key);
  set("access.plugin", "builtin.Access-Permissions");
  set_file("access.builtin.Access-Permissions.permissions_ca", files.authority);
  set_file("access.builtin.Access-Permissions.governance", files.governance);
  set_file("access.builtin.Access-Permissions.permissions", files.permissions);
  set("crypto.plugin", "builtin.AES-GCM-GMAC");
  return {};
}

/// Ends the program when somebody else is revoked: whoever starts it again, does so with the list
/// as it then is. Null for an open participant.
std::shared_ptr<RevocationWatch> WatchRevocations(const ParticipantOptions& options) {
  if (options.security.empty()) return nullptr;
  return std::make_shared<RevocationWatch>(RevocationWatch::Options{
      .list = security::FilesOf(options.security).revocations,
      .on_revoked =
          [log = options.log](const std::string& serial) {
            if (log != nullptr) {
              log->Warning("ending: a member was revoked, and who starts again refuses it",
                           {{"serial", serial}});
            }
            EndProcess();
          },
      .on_day = [options] { WarnOfFolder(options); }});
}

}  // namespace

BytesType::BytesType(const std::string& type_name, bool keyed) {
  setName(type_name.c_str());
  m_typeSize = kTypicalSampleBytes;
  m_isGetKeyDefined = keyed;
  // Type objects in discovery crash other Fast DDS 2.9 participants.
  auto_fill_type_object(false);
  auto_fill_type_information(false);
}

bool BytesType::serialize(void* data, rtps::SerializedPayload_t* payload) {
  const auto& bytes = *static_cast<const Bytes*>(data);
  if (bytes.cdr.size() > payload->max_size || bytes.cdr.size() < 2) return false;
  std::memcpy(payload->data, bytes.cdr.data(), bytes.cdr.size());
  payload->length = static_cast<std::uint32_t>(bytes.cdr.size());
  payload->encapsulation = bytes.cdr[1] == 0 ? CDR_BE : CDR_LE;
  return true;
}

bool BytesType::deserialize(rtps::SerializedPayload_t* payload, void* data) {
  static_cast<Bytes*>(data)->cdr.assign(payload->data, payload->data + payload->length);
  return true;
}

std::function<std::uint32_t()> BytesType::getSerializedSizeProvider(void* data) {
  return [data] { return static_cast<std::uint32_t>(static_cast<const Bytes*>(data)->cdr.size()); };
}

void* BytesType::createData() { return new Bytes; }

void BytesType::deleteData(void* data) { delete static_cast<Bytes*>(data); }

bool BytesType::getKey(void* data, rtps::InstanceHandle_t* handle, bool) {
  if (!m_isGetKeyDefined) return false;
  const auto& key = static_cast<const Bytes*>(data)->key;
  for (std::size_t i = 0; i < key.size(); ++i) handle->value[i] = key[i];
  // The zero handle stands for "none"; what was read has no key, and is one instance.
  if (!handle->isDefined()) handle->value[0] = 1;
  return true;
}

void ParticipantDeleter::operator()(dds::DomainParticipant* participant) const {
  participant->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant);
}

Result<ParticipantPtr> MakeDdsParticipant(const ParticipantOptions& options, Part part,
                                          dds::DomainParticipantListener* listener) {
  if (Status checked = CheckOptions(options); !checked.ok()) return checked.error();
  Result<std::vector<std::string>> interfaces = ResolveInterfaces(options.interfaces);
  if (!interfaces.ok()) return interfaces.error();
  Result<rtps::LocatorList_t> peers = InitialPeers(options.domain, options.peers);
  if (!peers.ok()) return peers.error();
  Result<DiscoveryServers> servers = FindDiscoveryServers(options.discovery_servers);
  if (!servers.ok()) return servers.error();

  // Within one process, too, samples take the network's way: otherwise callbacks would run on the
  // writing thread, under the writer's locks.
  static std::once_flag settings_made;
  std::call_once(settings_made, [] {
    eprosima::fastrtps::LibrarySettingsAttributes settings;
    settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
    eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
    // Standard output belongs to a program's answers.
    dds::Log::ClearConsumers();
    dds::Log::RegisterConsumer(std::make_unique<dds::StdoutErrConsumer>());
  });

  dds::DomainParticipantQos qos;
  qos.name(options.name);
  if (Status secured = Secure(options, qos); !secured.ok()) return secured.error();
  qos.user_data().setValue({options.user_data.begin(), options.user_data.end()});
  // Told to all who discover it, for `exemplar doctor`.
  qos.properties().properties().emplace_back("exemplar.version", EXEMPLAR_VERSION, true);
  if (part == Part::kLooksOn) qos.properties().properties().emplace_back(kOnlooker, "true", true);
  rtps::DiscoverySettings& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.leaseDuration = eprosima::fastrtps::Duration_t(kLeaseSeconds, 0);
  discovery.leaseDuration_announcementperiod =
      eprosima::fastrtps::Duration_t(kAnnouncementSeconds, 0);
  if (servers->empty()) {
    qos.wire_protocol().builtin.initialPeersList = *peers;
  } else {
    discovery.discoveryProtocol = part == Part::kTakesPart
                                      ? rtps::DiscoveryProtocol_t::CLIENT
                                      : rtps::DiscoveryProtocol_t::SUPER_CLIENT;
    discovery.m_DiscoveryServers = std::move(*servers);
  }

  qos.transport().use_builtin_transports = false;
  if (const std::uint32_t bytes = SharedMemoryBytes(options.shared_memory_bytes); bytes > 0) {
    auto shared_memory = std::make_shared<eprosima::fastdds::rtps::SharedMemTransportDescriptor>();
    shared_memory->segment_size(bytes);
    qos.transport().user_transports.push_back(std::move(shared_memory));
  }
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = *interfaces;
  udp->maxInitialPeersRange = kUnicastPeers;
  udp->sendBufferSize = kSocketBufferBytes;
  udp->receiveBufferSize = kSocketBufferBytes;
  qos.transport().user_transports.push_back(std::move(udp));

  dds::DomainParticipant* participant =
      dds::DomainParticipantFactory::get_instance()->create_participant(
          static_cast<dds::DomainId_t>(options.domain), qos, listener, dds::StatusMask::none());
  if (participant == nullptr) {
    const std::string others = options.security.empty()
                                   ? "are too many running on this machine already?"
                                   : "does the station's CRL name its own certificate, or do too "
                                     "many run on this machine already?";
    return Unavailable("Fast DDS made no participant in domain " + std::to_string(options.domain) +
                       ": " + others);
  }
  return ParticipantPtr(participant, ParticipantDeleter{.watch = WatchRevocations(options)});
}

Result<dds::Topic*> MakeTopic(dds::DomainParticipant& participant, const std::string& topic,
                              const std::string& type_name, bool keyed) {
  if (topic.empty() || topic.size() > 255 || type_name.empty() || type_name.size() > 255) {
    return InvalidArgument("topic \"" + topic + "\" of type \"" + type_name +
                           "\": both names must have 1 to 255 bytes");
  }
  dds::TypeSupport type = participant.find_type(type_name);
  if (type.empty()) {
    type = dds::TypeSupport(new BytesType(type_name, keyed));
    type.register_type(&participant);
  }
  dds::Topic* made = participant.create_topic(topic, type_name, dds::TOPIC_QOS_DEFAULT);
  if (made == nullptr) {
    return Internal("topic " + topic + ": Fast DDS refused type " + type_name);
  }
  return made;
}

dds::DataReaderQos ReaderQos(bool reliable, bool transient_local, int max_samples) {
  dds::DataReaderQos qos;
  qos.reliability().kind =
      reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind =
      transient_local ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = dds::KEEP_ALL_HISTORY_QOS;
  dds::ResourceLimitsQosPolicy& limits = qos.resource_limits();
  limits.max_samples = max_samples;
  limits.max_samples_per_instance = max_samples;
  limits.max_instances = 1;
  limits.allocated_samples = 16;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos.data_sharing().off();
  return qos;
}

std::string ToText(const rtps::GUID_t& guid) {
  std::ostringstream text;
  text << guid;
  return text.str();
}

ircp::Guid ToGuid(const rtps::GUID_t& guid) {
  ircp::Guid bytes{};
  const auto entity =
      std::copy(std::begin(guid.guidPrefix.value), std::end(guid.guidPrefix.value), bytes.begin());
  std::copy(std::begin(guid.entityId.value), std::end(guid.entityId.value), entity);
  return bytes;
}

Stamp ToStamp(const rtps::Time_t& time) { return Stamp::FromNanoseconds(time.to_ns()); }

bool Onlookers::Has(const rtps::GuidPrefix_t& participant) const {
  const std::lock_guard lock(mutex_);
  return found_.count(participant) != 0;
}

void Onlookers::on_participant_discovery(dds::DomainParticipant*,
                                         rtps::ParticipantDiscoveryInfo&& info) {
  const bool gone = info.status == rtps::ParticipantDiscoveryInfo::REMOVED_PARTICIPANT ||
                    info.status == rtps::ParticipantDiscoveryInfo::DROPPED_PARTICIPANT;
  bool looks_on = false;
  for (const auto& property : info.info.m_properties) {
    looks_on = looks_on || property.first() == kOnlooker;
  }
  const std::lock_guard lock(mutex_);
  if (gone) {
    found_.erase(info.info.m_guid.guidPrefix);
  } else if (looks_on) {
    found_.insert(info.info.m_guid.guidPrefix);
  }
}

int ReaderCount::count() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(
      std::count_if(readers_.begin(), readers_.end(),
                    [this](const auto& reader) { return !onlookers_.Has(reader.guidPrefix); }));
}

void ReaderCount::on_publication_matched(dds::DataWriter*,
                                         const dds::PublicationMatchedStatus& status) {
  rtps::GUID_t reader;
  rtps::iHandle2GUID(reader, status.last_subscription_handle);
  const std::lock_guard lock(mutex_);
  if (status.current_count_change > 0) {
    readers_.insert(reader);
  } else {
    readers_.erase(reader);
  }
}

ArrivalGate::ArrivalGate(const Clock& clock, OnArrival on_arrival)
    : clock_(clock), on_arrival_(std::move(on_arrival)) {}

void ArrivalGate::Close() {
  const std::lock_guard lock(mutex_);
  on_arrival_ = nullptr;
}

void ArrivalGate::on_data_available(dds::DataReader* reader) {
  Bytes bytes;
  dds::SampleInfo info;
  // The lock comes after taking: Fast DDS may hold the reader's own lock around this call.
  while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
    const Stamp received = clock_.Now();
    const std::lock_guard lock(mutex_);
    if (on_arrival_ == nullptr) return;
    on_arrival_({.cdr = std::move(bytes.cdr),
                 .writer = WriterName(info.sample_identity.writer_guid()),
                 .sequence = info.sample_identity.sequence_number().to64long(),
                 .source_stamp = ToStamp(info.source_timestamp),
                 .received = received,
                 .valid = info.valid_data});
    bytes.cdr.clear();
  }
}

const std::string& ArrivalGate::WriterName(const rtps::GUID_t& guid) {
  std::string& name = writers_[guid];
  if (name.empty()) name = ToText(guid);
  return name;
}

}  // namespace exemplar::bus
