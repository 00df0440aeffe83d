#pragma once
#include <functional>
#include <string>
#include <vector>

#include "exemplar/api/json_calls.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/http/server.hpp"

namespace exemplar::gateway {

/// What GET /healthz tells of the gateway.
struct HealthLine {
  std::string name;  ///< of a server behind
  std::string address;
  bool serving = false;
};

struct HttpApi {
  /// Every call at POST /<service>/<method>, those that change nothing at GET as well, all of them
  /// described at GET /openapi.json. Null: none.
  api::JsonCalls* calls = nullptr;
  std::function<std::vector<HealthLine>()> health;  ///< GET /healthz
  std::function<std::string()> metrics;             ///< GET /metrics
  /// Made for requests that bring no X-Request-Id.
  std::function<std::string()> make_request_id;
  /// Of a call without Connect-Timeout-Ms.
  Duration timeout = std::chrono::minutes(10);
  /// What a request may have, and one whose call takes a stream (files).
  std::size_t body_bytes = std::size_t{16} << 20;
  std::size_t stream_body_bytes = std::size_t{256} << 20;
};

/// Before the server's start. What `api` holds outlives the server.
Status AddRoutes(http::Server& server, const HttpApi& api);

}  // namespace exemplar::gateway
