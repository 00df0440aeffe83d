#pragma once
// Says why participants of the network do not see or hear each other, from what was observed. Pure.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/stamp.hpp"
#include "exemplar/ircp/clock_relation.hpp"
#include "exemplar/ircp/discovery.hpp"

namespace exemplar::diagnosis {

enum class Severity {
  kNote,     ///< as it may well be meant
  kWarning,  ///< works, but not as well as it should
  kProblem,  ///< somebody does not hear what they ask for
};
std::string_view ToString(Severity severity);

struct Finding {
  Severity severity = Severity::kNote;
  /// One of "participant", "domain", "station", "qos", "type", "topic", "security", "transport",
  /// "clock", "service", "version".
  std::string cause;
  std::string what;    ///< a sentence with the names and values
  std::string remedy;  ///< what to do, as a sentence
  std::string topic{};
  std::string policy{};                     ///< of a "qos": the policy's name
  std::vector<std::string> participants{};  ///< their names
  friend bool operator==(const Finding&, const Finding&) = default;
};

/// What a service said when asked for its health.
struct ServiceAnswer {
  std::string address;
  bool reachable = false;
  bool serving = false;
  std::string detail{};
  std::string version{};
};

struct Evidence {
  int domain = 0;  ///< that is asked about
  std::string station = "default";
  bool secured = false;  ///< whether the observer has an identity
  /// What is wrong with it soon, a sentence each.
  std::vector<std::string> identity_warnings{};
  std::string version{};        ///< of the observer
  ircp::Discovery discovery{};  ///< of all observed domains
  std::vector<ircp::SeenInterface> interfaces{};
  std::vector<ircp::Reachability> reachability{};
  std::vector<ircp::ClockRelation> clocks{};  ///< of programs of the station, against our clock
  std::vector<ServiceAnswer> services{};
  /// Names of the participants that are asked about; empty: all.
  std::vector<std::string> names{};
};

/// Topics that flow, with how many pairs of a writer and a reader.
struct Flow {
  std::string topic;
  int domain = 0;
  std::vector<std::string> from, to;  ///< participants' names, each once
};

struct Diagnosis {
  std::vector<Finding> findings;  ///< problems first
  std::vector<Flow> flows;
};

Diagnosis Diagnose(const Evidence& evidence);

/// What keeps a reader from hearing a writer of the same topic, type and partition.
struct Mismatch {
  std::string policy;   ///< "reliability", "deadline", ...
  std::string offered;  ///< by the writer, in words
  std::string asked;    ///< by the reader
};
std::vector<Mismatch> Compare(const ircp::EndpointQos& offered, const ircp::EndpointQos& asked);
/// Whether two lists of partitions meet (DDS 1.4, 2.2.3.13): names, or patterns of one side with
/// * ? [ ].
bool PartitionsMeet(const std::vector<std::string>& a, const std::vector<std::string>& b);

}  // namespace exemplar::diagnosis
