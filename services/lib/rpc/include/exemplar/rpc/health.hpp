#pragma once
#include "exemplar/rpc/client.hpp"

namespace exemplar::rpc {

/// Asks the server's health service for the whole server: true when it serves. A server without a
/// health service is well when it answers. Errors: as of any call.
Result<bool> AskHealth(const ClientOptions& options);

}  // namespace exemplar::rpc
