#pragma once
#include <vector>

#include "exemplar/ircp/bus.hpp"

namespace exemplar::gateway {

/// The topics of ircp/samples.hpp as their writers offer them.
std::vector<ircp::RawTopic> KnownTopics();

}  // namespace exemplar::gateway
