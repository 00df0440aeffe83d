#pragma once
// Who is on the network and what they offer and ask for, as values: what `exemplar doctor` judges.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "exemplar/base/stamp.hpp"

namespace exemplar::ircp {

struct SeenLocator {
  enum class Kind { kUdp4, kUdp6, kTcp, kSharedMemory, kOther };
  Kind kind = Kind::kOther;
  std::string address{};  ///< "192.168.1.7"; for shared memory the number of the machine
  std::uint32_t port = 0;
  friend bool operator==(const SeenLocator&, const SeenLocator&) = default;
};

struct SeenParticipant {
  std::string id{};  ///< as ircp::ParticipantOf() gives it for its writers
  std::string name{};
  int domain = 0;
  std::string vendor{};                             ///< "Fast DDS", "Cyclone DDS", ...
  std::map<std::string, std::string> properties{};  ///< "exemplar.version", ...
  /// Carries a DDS-Security identity: talks only to those whom its authority signed.
  bool secured = false;
  enum class Trust { kNotAsked, kTrusted, kRefused };
  Trust trust = Trust::kNotAsked;  ///< of a secured observer in it
  std::vector<SeenLocator> locators{};
};

/// The policies by which a writer and a reader of one topic match or do not (DDS 1.4, 2.2.3). What
/// a writer offers or a reader asks for.
struct EndpointQos {
  bool reliable = false;
  int durability = 0;    ///< 0 volatile, 1 transient local, 2 transient, 3 persistent
  Duration deadline{0};  ///< 0: none
  Duration latency_budget{0};
  bool exclusive_ownership = false;
  int liveliness = 0;            ///< 0 automatic, 1 manual by participant, 2 manual by topic
  Duration liveliness_lease{0};  ///< 0: none
  bool ordered_by_source = false;
  int access_scope = 0;  ///< 0 instance, 1 topic, 2 group
  bool coherent_access = false;
  bool ordered_access = false;
  std::vector<int> representations{};  ///< 0 XCDR1, 1 XML, 2 XCDR2; empty: XCDR1
};

struct SeenEndpoint {
  std::string id{};
  std::string participant{};  ///< SeenParticipant::id
  int domain = 0;
  bool writer = false;
  std::string topic{};
  std::string type{};
  std::string schema{};                   ///< flattened IDL where it carries one
  std::vector<std::string> partitions{};  ///< empty: the one without a name
  bool keyed = false;
  EndpointQos qos;
};

struct Discovery {
  std::vector<SeenParticipant> participants{};
  std::vector<SeenEndpoint> endpoints{};
};

/// How one network interface carries multicast, as tried from here to here.
struct SeenInterface {
  std::string name{};
  std::string address{};
  bool loopback = false;
  bool multicast = false;  ///< a datagram to the discovery group came back
  std::string detail{};    ///< why not
};

/// What became of datagrams to a participant's addresses.
struct Reachability {
  std::string participant{};
  bool reachable = true;  ///< at least one address took them, or said nothing against it
  std::string detail{};   ///< "10.0.0.7:7411: network is unreachable"
};

}  // namespace exemplar::ircp
