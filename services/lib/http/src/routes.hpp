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
};

class Routes {
 public:
  struct Found {
    const RouteEntry* route = nullptr;
    std::map<std::string, std::string> variables;
    std::vector<Method> methods;  ///< that the path has, where this one is not among them
  };

  Status Add(RouteEntry route);
  /// HEAD is answered by GET's handler.
  Found Find(Method method, const std::vector<std::string>& segments) const;

 private:
  std::vector<std::unique_ptr<RouteEntry>> routes_;
};

}  // namespace exemplar::http
