#pragma once
// Which handler a request is for.

#include <variant>

#include "exemplar/http/server.hpp"

namespace exemplar::http {

struct RouteEntry {
  PathPattern pattern;
  Method method = Method::kGet;
  RouteOptions options;
  std::variant<Handler, StreamHandler, WebSocketEndpoint> handler;
  /// Of an endpoint: clients there are now.
  std::shared_ptr<std::atomic<std::size_t>> clients;

  bool is_websocket() const { return std::holds_alternative<WebSocketEndpoint>(handler); }
};

class Routes {
 public:
  struct Found {
    const RouteEntry* route = nullptr;
    std::map<std::string, std::string> variables;
    std::vector<Method> methods;  ///< that the path has, where this one is not among them
  };

  /// A path may have a page for GET and an endpoint for WebSockets.
  Status Add(RouteEntry route);
  /// HEAD is answered by GET's handler. Where a path has both, `wants_websocket` chooses.
  Found Find(Method method, const std::vector<std::string>& segments,
             bool wants_websocket = false) const;

 private:
  std::vector<std::unique_ptr<RouteEntry>> routes_;
};

}  // namespace exemplar::http
