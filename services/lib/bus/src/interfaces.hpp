#pragma once
#include <vector>

#include "exemplar/ircp/discovery.hpp"

namespace exemplar::bus {

/// The interfaces that are up and have an IPv4 address. Whether they carry multicast is as they are
/// set, not tried.
std::vector<ircp::SeenInterface> InterfacesUp();

}  // namespace exemplar::bus
