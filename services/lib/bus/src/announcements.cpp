// Participants' announcements as datagrams: RTPS 2.2, 8.3.7.2 (DATA), 8.5.3.2 (SPDP), 9.4 (the
// bytes), 9.6.2 (the parameters).

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>

#include "exemplar/bus/discovery.hpp"
#include "interfaces.hpp"
#include "rtps_names.hpp"

namespace exemplar::bus {
namespace {

using ircp::SeenParticipant;

constexpr int kDomains = 233;
constexpr int kPortBase = 7400;
constexpr int kPortsOfDomain = 250;
constexpr int kFirstUnicastPort = 10;
constexpr std::size_t kPrefixBytes = 12;
constexpr std::size_t kLocatorBytes = 24;

constexpr std::uint8_t kData = 0x15;
constexpr std::array<std::uint8_t, 4> kAnnouncer{0x00, 0x01, 0x00, 0xc2};

enum Parameter : std::uint16_t {
  kEnd = 0x0001,
  kDomainId = 0x000f,
  kVendor = 0x0016,
  kDefaultUnicast = 0x0031,
  kMetatrafficUnicast = 0x0032,
  kParticipantGuid = 0x0050,
  kProperties = 0x0059,
  kName = 0x0062,
  kIdentityToken = 0x1001,
};

/// Reads within bounds; past the end, zeroes, and `good` is false from then on.
class ByteReader {
 public:
  ByteReader(std::span<const std::uint8_t> bytes, bool little) : bytes_(bytes), little_(little) {}

  bool good() const { return good_; }
  std::size_t left() const { return bytes_.size(); }
  std::span<const std::uint8_t> Take(std::size_t count) {
    if (count > bytes_.size()) {
      good_ = false;
      bytes_ = {};
      return {};
    }
    const auto taken = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return taken;
  }
  std::uint32_t Number(std::size_t bytes) {
    const auto taken = Take(bytes);
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < taken.size(); ++i) {
      number |= std::uint32_t{taken[i]} << (8 * (little_ ? i : taken.size() - 1 - i));
    }
    return number;
  }
  /// With its length before it and a zero behind it, padded to four bytes.
  std::string Text() {
    const std::uint32_t length = Number(4);
    const auto taken = Take(length);
    Take(std::min<std::size_t>((4 - length % 4) % 4, left()));
    return {taken.begin(), taken.empty() ? taken.end() : taken.end() - 1};
  }

 private:
  std::span<const std::uint8_t> bytes_;
  bool little_;
  bool good_ = true;
};

std::string PrefixText(std::span<const std::uint8_t> prefix) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : prefix) {
    if (!text.empty()) text += '.';
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

void ReadParameter(std::uint16_t id, ByteReader value, SeenParticipant& participant) {
  switch (id) {
    case kName:
      participant.name = value.Text();
      break;
    case kDomainId:
      participant.domain = static_cast<int>(value.Number(4) % kDomains);
      break;
    case kVendor:
      if (const auto bytes = value.Take(2); value.good()) {
        participant.vendor = VendorName(bytes[0], bytes[1]);
      }
      break;
    case kIdentityToken:
      participant.secured = true;
      break;
    case kDefaultUnicast:
    case kMetatrafficUnicast: {
      if (value.left() != kLocatorBytes) break;
      const auto kind = static_cast<std::int32_t>(value.Number(4));
      const std::uint32_t port = value.Number(4);
      participant.locators.push_back(LocatorFrom(kind, port, value.Take(16).first<16>()));
      break;
    }
    case kProperties:
      for (std::uint32_t left = value.Number(4); left > 0 && value.good(); --left) {
        const std::string name = value.Text();
        if (std::string text = value.Text(); value.good()) participant.properties[name] = text;
      }
      break;
    default:
      break;
  }
}

/// The parameters of a DATA submessage that announces a participant, or nullopt.
std::optional<SeenParticipant> ReadData(ByteReader data, std::uint8_t flags) {
  constexpr std::uint8_t kInlineQos = 2;
  constexpr std::uint8_t kHasData = 4;
  if ((flags & kHasData) == 0 || (flags & kInlineQos) != 0) return std::nullopt;
  data.Take(2);
  const std::uint32_t to_inline_qos = data.Number(2);
  data.Take(4);
  const auto writer = data.Take(4);
  if (!data.good() || !std::equal(writer.begin(), writer.end(), kAnnouncer.begin())) {
    return std::nullopt;
  }
  data.Take(8);
  constexpr std::uint32_t kUsual = 16;
  if (to_inline_qos < kUsual) return std::nullopt;
  data.Take(to_inline_qos - kUsual);
  // PL_CDR_BE is 0x0002, PL_CDR_LE 0x0003.
  const auto encapsulation = data.Take(4);
  if (!data.good() || encapsulation[0] != 0 || (encapsulation[1] & 0xfe) != 2) return std::nullopt;
  const bool little_list = encapsulation[1] == 3;
  ByteReader list(data.Take(data.left()), little_list);
  SeenParticipant participant;
  participant.domain = -1;
  while (list.left() >= 4) {
    const auto id = static_cast<std::uint16_t>(list.Number(2));
    const std::uint32_t length = list.Number(2);
    if (id == kEnd) return participant;
    const auto value = list.Take(length);
    if (!list.good()) return std::nullopt;
    ReadParameter(id, ByteReader(value, little_list), participant);
  }
  return std::nullopt;
}

struct Socket {
  Socket() : fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {}
  ~Socket() {
    if (fd >= 0) ::close(fd);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  const int fd;
};

/// Joined on every interface that has an address, so that none is missed.
void JoinDiscoveryGroup(int fd, const std::vector<ircp::SeenInterface>& interfaces) {
  for (const ircp::SeenInterface& interface : interfaces) {
    ip_mreq group{};
    ::inet_pton(AF_INET, "239.255.0.1", &group.imr_multiaddr);
    ::inet_pton(AF_INET, interface.address.c_str(), &group.imr_interface);
    ::setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group);
  }
}

}  // namespace

std::optional<SeenParticipant> ReadAnnouncement(std::span<const std::uint8_t> datagram) {
  constexpr std::size_t kHeaderBytes = 20;
  if (datagram.size() < kHeaderBytes || std::memcmp(datagram.data(), "RTPS", 4) != 0) {
    return std::nullopt;
  }
  const std::string id = PrefixText(datagram.subspan(8, kPrefixBytes));
  std::span<const std::uint8_t> rest = datagram.subspan(kHeaderBytes);
  while (rest.size() >= 4) {
    const std::uint8_t kind = rest[0];
    const std::uint8_t flags = rest[1];
    const bool little = (flags & 1) != 0;
    std::size_t length = ByteReader(rest.subspan(2, 2), little).Number(2);
    rest = rest.subspan(4);
    // 0: to the end of the datagram.
    if (length == 0 || length > rest.size()) length = rest.size();
    if (kind == kData) {
      auto participant = ReadData(ByteReader(rest.first(length), little), flags);
      if (participant) {
        participant->id = id;
        if (participant->vendor.empty()) participant->vendor = VendorName(datagram[6], datagram[7]);
        return participant;
      }
    }
    rest = rest.subspan(length);
  }
  return std::nullopt;
}

Result<std::vector<SeenParticipant>> HearAnnouncements(Duration duration,
                                                       const std::stop_token& stop) {
  const std::vector<ircp::SeenInterface> interfaces = InterfacesUp();
  std::map<int, std::unique_ptr<Socket>> by_domain;
  std::vector<pollfd> watched;
  std::vector<int> domains;
  for (int domain = 0; domain < kDomains; ++domain) {
    const int port = kPortBase + kPortsOfDomain * domain;
    auto socket = std::make_unique<Socket>();
    if (socket->fd < 0) {
      return Unavailable(std::string("no socket to hear announcements: ") + std::strerror(errno));
    }
    const int yes = 1;
    ::setsockopt(socket->fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    // Bound to the group, so that unicast meant for a participant never comes here.
    ::inet_pton(AF_INET, "239.255.0.1", &address.sin_addr);
    if (::bind(socket->fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      continue;
    }
    JoinDiscoveryGroup(socket->fd, interfaces);
    watched.push_back({socket->fd, POLLIN, 0});
    domains.push_back(domain);
    by_domain[domain] = std::move(socket);
  }

  std::map<std::string, SeenParticipant> heard;
  const auto end = std::chrono::steady_clock::now() + duration;
  std::vector<std::uint8_t> datagram(1 << 16);
  while (!stop.stop_requested()) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    if (left.count() <= 0) break;
    constexpr int kLongestMs = 100;  // until a stop is noticed
    if (::poll(watched.data(), watched.size(),
               static_cast<int>(std::min<std::int64_t>(left.count(), kLongestMs))) <= 0) {
      continue;
    }
    for (std::size_t i = 0; i < watched.size(); ++i) {
      if ((watched[i].revents & POLLIN) == 0) continue;
      const ssize_t size = ::recv(watched[i].fd, datagram.data(), datagram.size(), 0);
      if (size <= 0) continue;
      auto participant = ReadAnnouncement({datagram.data(), static_cast<std::size_t>(size)});
      if (!participant) continue;
      if (participant->domain < 0) participant->domain = domains[i];
      heard[participant->id] = std::move(*participant);
    }
  }
  std::vector<SeenParticipant> participants;
  participants.reserve(heard.size());
  for (auto& entry : heard) participants.push_back(std::move(entry.second));
  return participants;
}

std::set<int> DomainsOfThisMachine() {
  std::set<int> ports;
  std::ifstream table("/proc/net/udp");
  std::string line;
  std::getline(table, line);  // its header
  while (std::getline(table, line)) {
    std::istringstream words(line);
    std::string number, local;
    words >> number >> local;
    const std::size_t colon = local.find(':');
    if (colon == std::string::npos) continue;
    ports.insert(static_cast<int>(std::strtol(local.c_str() + colon + 1, nullptr, 16)));
  }
  std::set<int> domains;
  for (int domain = 0; domain < kDomains; ++domain) {
    const int first = kPortBase + kPortsOfDomain * domain;
    // A participant holds the group's port, and one of its own behind it.
    const auto own = ports.lower_bound(first + kFirstUnicastPort);
    if (ports.count(first) != 0 && own != ports.end() && *own < first + kPortsOfDomain) {
      domains.insert(domain);
    }
  }
  return domains;
}

}  // namespace exemplar::bus
