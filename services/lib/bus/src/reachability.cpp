// What the system's network says of the ways between participants.

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <set>
#include <string>

#include "exemplar/base/text.hpp"
#include "exemplar/bus/discovery.hpp"
#include "interfaces.hpp"

namespace exemplar::bus {
namespace {

using ircp::Reachability;
using ircp::SeenInterface;
using ircp::SeenLocator;
using ircp::SeenParticipant;

constexpr int kPatienceMs = 200;

struct Socket {
  Socket() : fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (fd >= 0) ::close(fd);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  const int fd;
};

sockaddr_in AddressOf(const std::string& text, std::uint32_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  ::inet_pton(AF_INET, text.c_str(), &address.sin_addr);
  return address;
}

/// Why no datagram of ours on this interface came back to us; empty when one did.
std::string TryMulticastOn(const std::string& address) {
  const Socket receiver;
  const Socket sender;
  const int yes = 1;
  sockaddr_in place = AddressOf("239.255.0.1", 0);
  ip_mreq group{};
  group.imr_multiaddr = place.sin_addr;
  ::inet_pton(AF_INET, address.c_str(), &group.imr_interface);
  // Bound to the group at a free port: nobody else listens there.
  socklen_t size = sizeof place;
  if (::bind(receiver.fd, reinterpret_cast<const sockaddr*>(&place), sizeof place) != 0 ||
      ::getsockname(receiver.fd, reinterpret_cast<sockaddr*>(&place), &size) != 0 ||
      ::setsockopt(receiver.fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) != 0) {
    return std::string("the discovery group cannot be joined: ") + std::strerror(errno);
  }
  ::setsockopt(sender.fd, IPPROTO_IP, IP_MULTICAST_IF, &group.imr_interface,
               sizeof group.imr_interface);
  ::setsockopt(sender.fd, IPPROTO_IP, IP_MULTICAST_LOOP, &yes, sizeof yes);
  constexpr std::string_view kWord = "exemplar doctor";
  if (::sendto(sender.fd, kWord.data(), kWord.size(), 0, reinterpret_cast<const sockaddr*>(&place),
               sizeof place) < 0) {
    return std::string("nothing can be sent to the discovery group: ") + std::strerror(errno);
  }
  pollfd watched{receiver.fd, POLLIN, 0};
  if (::poll(&watched, 1, kPatienceMs) <= 0) return "what was sent did not come back";
  return {};
}

/// What the system says of an RTPS message without content to there; empty: nothing against it.
std::string TryUdp(const SeenLocator& locator) {
  const Socket socket;
  const sockaddr_in address = AddressOf(locator.address, locator.port);
  // The RTPS header of version 2.2 and nothing behind it: whoever gets it ignores it.
  constexpr std::array<std::uint8_t, 20> kEmpty{'R', 'T', 'P', 'S', 2, 2, 1, 0x0f};
  if (::connect(socket.fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::send(socket.fd, kEmpty.data(), kEmpty.size(), 0) < 0) {
    return std::strerror(errno);
  }
  // A closed port is told by the other machine, on this one at once.
  pollfd watched{socket.fd, POLLIN, 0};
  ::poll(&watched, 1, kPatienceMs);
  int error = 0;
  socklen_t size = sizeof error;
  ::getsockopt(socket.fd, SOL_SOCKET, SO_ERROR, &error, &size);
  return error == 0 ? std::string() : std::strerror(error);
}

}  // namespace

std::vector<SeenInterface> InterfacesUp() {
  std::vector<SeenInterface> interfaces;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return interfaces;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET ||
        (entry->ifa_flags & IFF_UP) == 0) {
      continue;
    }
    sockaddr_in address{};
    std::memcpy(&address, entry->ifa_addr, sizeof address);
    char text[INET_ADDRSTRLEN] = {};
    ::inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
    interfaces.push_back({.name = entry->ifa_name,
                          .address = text,
                          .loopback = (entry->ifa_flags & IFF_LOOPBACK) != 0,
                          .multicast = (entry->ifa_flags & IFF_MULTICAST) != 0});
  }
  ::freeifaddrs(list);
  return interfaces;
}

std::vector<SeenInterface> TryMulticast() {
  std::vector<SeenInterface> interfaces = InterfacesUp();
  for (SeenInterface& interface : interfaces) {
    interface.detail = interface.multicast ? TryMulticastOn(interface.address)
                                           : std::string("the interface is not for multicast");
    interface.multicast = interface.detail.empty();
  }
  return interfaces;
}

std::vector<Reachability> TryToReach(std::span<const SeenParticipant> participants) {
  std::set<std::string> own;
  for (const SeenInterface& interface : InterfacesUp()) own.insert(interface.address);
  std::vector<Reachability> found;
  for (const SeenParticipant& participant : participants) {
    Reachability reachability{.participant = participant.id};
    std::vector<std::string> against;
    int tried = 0;
    bool here = false;
    std::vector<SeenLocator> done;
    for (const SeenLocator& locator : participant.locators) {
      if (locator.kind != SeenLocator::Kind::kUdp4 ||
          std::find(done.begin(), done.end(), locator) != done.end()) {
        continue;
      }
      done.push_back(locator);
      here = here || own.count(locator.address) != 0;
      ++tried;
      if (const std::string error = TryUdp(locator); !error.empty()) {
        against.push_back(locator.address + ":" + std::to_string(locator.port) + ": " + error);
      }
    }
    if (tried > 0 && static_cast<int>(against.size()) == tried) {
      reachability.reachable = false;
      reachability.detail = Join(against, "; ");
    }
    for (const SeenLocator& locator : participant.locators) {
      // Fast DDS keeps a port of shared memory under this name.
      const std::string file = "/dev/shm/fastrtps_port" + std::to_string(locator.port);
      if (locator.kind == SeenLocator::Kind::kSharedMemory && here &&
          !std::filesystem::exists(file)) {
        reachability.reachable = false;
        reachability.detail = "it is on this machine, but its shared memory " + file + " is not";
        break;
      }
    }
    found.push_back(std::move(reachability));
  }
  return found;
}

}  // namespace exemplar::bus
