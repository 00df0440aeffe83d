#pragma once
// Looks at who is on the network without taking part in any topic.

#include <memory>
#include <optional>
#include <set>
#include <span>
#include <stop_token>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/ircp/discovery.hpp"

namespace exemplar::bus {

/// Watches one domain's discovery through a participant of its own, whatever the stations. What is
/// secured with an authority other than options.security shows its participants only. Thread-safe.
class DiscoveryObserver {
 public:
  static Result<std::unique_ptr<DiscoveryObserver>> Create(ParticipantOptions options);
  virtual ~DiscoveryObserver() = default;
  /// Who is there now; this observer itself is left out.
  virtual ircp::Discovery Now() const = 0;
};

/// The domains in which participants of this machine (this network namespace) listen, by the ports
/// that they hold.
std::set<int> DomainsOfThisMachine();

/// Hears the announcements of all domains by multicast for `duration`, without answering. Errors:
/// no socket can be made.
Result<std::vector<ircp::SeenParticipant>> HearAnnouncements(Duration duration,
                                                             const std::stop_token& stop);
/// One announcement as it lies in a datagram (RTPS 2.2, 8.5.3.2); nullopt for other datagrams.
std::optional<ircp::SeenParticipant> ReadAnnouncement(std::span<const std::uint8_t> datagram);

/// Sends the discovery group a datagram on each interface that is up, and waits for it there.
std::vector<ircp::SeenInterface> TryMulticast();

/// Sends empty datagrams to the UDP addresses of each participant and asks the system what became
/// of them; asks for the shared memory of those on this machine.
std::vector<ircp::Reachability> TryToReach(std::span<const ircp::SeenParticipant> participants);

}  // namespace exemplar::bus
