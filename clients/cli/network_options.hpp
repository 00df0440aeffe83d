#pragma once
// The options of commands that go to the topics without a server.

#include <string>
#include <vector>

#include "command_line.hpp"
#include "exemplar/bus/participant.hpp"

namespace exemplar::cli {

struct NetworkWords {
  std::optional<double> domain;  ///< absent: 0
  std::string station;           ///< empty: "default"
  std::vector<std::string> interfaces, peers, discovery_servers;
  std::string security;

  bool given() const { return domain.has_value() || !station.empty(); }
};

/// Adds --domain, --station, --interface, --peer, --discovery-server and --security.
void AddNetworkOptions(Command& command, NetworkWords& words);
/// Errors: a domain that is none.
Result<bus::ParticipantOptions> NetworkOf(const NetworkWords& words, const std::string& name);

}  // namespace exemplar::cli
