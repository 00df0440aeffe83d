#pragma once
// Recording and execution as services of the Foxglove protocol.

#include <string>
#include <vector>

#include "exemplar/api/json_calls.hpp"
#include "gateway/foxglove/bridge.hpp"

namespace exemplar::gateway::foxglove {

/// "/recorder/start", "/executor/execute", ...: calls of the gateway's as it serves them itself,
/// under the authorization that the client's connection brought. Of a call that streams, the answer
/// is its last message. `calls` outlives the services. docs/foxglove.md lists them.
std::vector<Service> StationServices(api::JsonCalls& calls);

/// "Bearer TOKEN" of a connection: its header, or ?token=TOKEN, since browsers give WebSockets no
/// headers; empty when there is none.
std::string AuthorizationOf(const http::Request& request);

}  // namespace exemplar::gateway::foxglove
