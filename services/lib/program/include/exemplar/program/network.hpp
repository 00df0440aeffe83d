#pragma once
// A program's options as its participant takes them. For programs that link exemplar::bus; the
// library itself does not.

#include <string>
#include <utility>

#include "exemplar/bus/participant.hpp"
#include "exemplar/program/options.hpp"

namespace exemplar::program {

/// `log` hears of what is refused, and outlives the participant.
inline bus::ParticipantOptions NetworkOf(const CommonOptions& common, std::string name, Log* log) {
  return {.domain = common.domain,
          .station = common.station,
          .name = std::move(name),
          .interfaces = common.interfaces,
          .peers = common.peers,
          .discovery_servers = common.discovery_servers,
          .best_effort_topics = common.best_effort,
          .security = common.security,
          .log = log};
}

}  // namespace exemplar::program
