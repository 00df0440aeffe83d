#include "routes.hpp"

#include <utility>

namespace exemplar::http {

Status Routes::Add(RouteEntry route) {
  for (const auto& other : routes_) {
    if (other->method == route.method && other->is_websocket() == route.is_websocket() &&
        other->pattern.text() == route.pattern.text()) {
      return InvalidArgument("route " + std::string(ToString(route.method)) + " " +
                             route.pattern.text() + " is there already");
    }
  }
  routes_.push_back(std::make_unique<RouteEntry>(std::move(route)));
  return {};
}

Routes::Found Routes::Find(Method method, const std::vector<std::string>& segments,
                           bool wants_websocket) const {
  if (method == Method::kHead) method = Method::kGet;
  Found found;
  for (const auto& route : routes_) {
    auto variables = route->pattern.Match(segments);
    if (!variables) continue;
    found.methods.push_back(route->method);
    if (route->method != method) continue;
    const bool is_better = found.route == nullptr ||
                           route->pattern.variables() < found.route->pattern.variables() ||
                           (route->pattern.variables() == found.route->pattern.variables() &&
                            found.route->is_websocket() != wants_websocket &&
                            route->is_websocket() == wants_websocket);
    if (is_better) {
      found.route = route.get();
      found.variables = std::move(*variables);
    }
  }
  return found;
}

}  // namespace exemplar::http
