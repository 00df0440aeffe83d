#include "network_options.hpp"

#include <cmath>

#include "exemplar/base/text.hpp"

namespace exemplar::cli {

void AddNetworkOptions(Command& command, NetworkWords& words) {
  command.Option("--domain", "N", words.domain, "DDS domain (default: 0)");
  command.Option("--station", "NAME", words.station, "the place (default: \"default\")");
  command.Option("--interface", "NAME", words.interfaces,
                 "network interface to use; several times");
  command.Option("--peer", "ADDRESS", words.peers,
                 "machine sought beside multicast; several times");
  command.Option("--discovery-server", "HOST:PORT", words.discovery_servers,
                 "instead of multicast; several times");
  command.Option("--security", "DIR", words.security,
                 "folder that `exemplar security issue` made: authenticated, encrypted topics");
}

Result<bus::ParticipantOptions> NetworkOf(const NetworkWords& words, const std::string& name) {
  const double domain = words.domain.value_or(0);
  constexpr int kMaxDomain = 232;
  if (!(domain >= 0 && domain <= kMaxDomain && std::floor(domain) == domain)) {
    return InvalidArgument(
        "--domain is " + FormatDouble(domain) + ", must be a whole number from 0 to 232", "domain");
  }
  return bus::ParticipantOptions{.domain = static_cast<int>(domain),
                                 .station = words.station.empty() ? "default" : words.station,
                                 .name = name,
                                 .interfaces = words.interfaces,
                                 .peers = words.peers,
                                 .discovery_servers = words.discovery_servers,
                                 .security = words.security};
}

}  // namespace exemplar::cli
