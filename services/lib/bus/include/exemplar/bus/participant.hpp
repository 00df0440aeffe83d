#pragma once
// The network: Fast DDS behind the ports of ircp/bus.hpp. The only library that includes it.

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/raw_writer.hpp"

namespace exemplar::bus {

/// Holds a few stereo pairs.
inline constexpr std::size_t kPictureSharedMemoryBytes = std::size_t{16} << 20;

struct ParticipantOptions {
  int domain = 0;                   ///< 0 to 232
  std::string station = "default";  ///< the partition of all its topics
  /// Instead of a station: its topics lie in no partition, where other middlewares' do by default.
  bool without_station = false;
  std::string name = "exemplar";  ///< as discovery tools show it
  std::string user_data = {};     ///< told to all who discover it
  /// Addresses or names ("127.0.0.1", "eth1") of the interfaces to use; empty: all.
  std::vector<std::string> interfaces = {};
  /// IPv4 addresses where other participants are sought beside multicast. The own machine is always
  /// sought, so that a loopback interface without multicast will do.
  std::vector<std::string> peers = {};
  /// "HOST:PORT" of Fast DDS discovery servers, the first with the id 0, the next 1, and so on.
  /// With one, nobody is sought by multicast: for networks that do not carry it.
  std::vector<std::string> discovery_servers = {};
  /// Topics that this program writes and reads best effort though the table has them reliable:
  /// where only the newest sample counts ("ircp/joint_state"). Its writers and readers must agree;
  /// taps read both.
  std::vector<std::string> best_effort_topics = {};
  /// Shared memory for neighbours on the same machine, at most this much of it (less where
  /// /dev/shm is small); 0: UDP only. For pictures (kPictureSharedMemoryBytes), and for nothing
  /// that must be in time: whenever a neighbour joins, Fast DDS 2.9 may hold up all that a
  /// participant with shared memory sends for 0.33 s (its check of the newcomer's port).
  std::size_t shared_memory_bytes = 0;
  /// Folder with cert.pem, key.pem and the rest that `exemplar security issue` makes: only
  /// participants of the same station's CA are talked to, encrypted, each on the topics that its
  /// permissions name. Empty: open. Not together with discovery_servers.
  std::string security = {};
  /// Stamps samples; null: the machine's. Outlives the participant.
  const Clock* clock = nullptr;
  /// The network's own time stamps of samples come from that clock too, which is simulated.
  bool stamps_all = false;
  /// Hears of malformed samples and incompatible writers; null: nobody. Outlives the participant.
  Log* log = nullptr;
};

/// One program's place on the network of a station. Thread-safe, except that the participant must
/// outlive its writers, readers and taps. Callbacks run on threads of the network, those of one
/// reader never at once; a callback must not destroy its own reader.
///
/// Writers of reliable topics wait up to 2 s on destruction until what they wrote has arrived.
class Participant : public ircp::Bus, public ircp::RawBus, public ircp::RawOutlet {
 public:
  static Result<std::unique_ptr<Participant>> Create(ParticipantOptions options);
};

}  // namespace exemplar::bus
