#pragma once
// What a request has to have to become a WebSocket.

#include "core.hpp"

namespace exemplar::http {

/// The first of the endpoint's subprotocols that the client's header offers; "" when the endpoint
/// has none; nullopt when there is none in common.
std::optional<std::string> ChooseSubprotocol(const WebSocketEndpoint& endpoint,
                                             std::string_view offered);

}  // namespace exemplar::http
