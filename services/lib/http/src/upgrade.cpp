#include "upgrade.hpp"

#include <algorithm>

#include "exemplar/base/text.hpp"

namespace exemplar::http {

std::optional<std::string> ChooseSubprotocol(const WebSocketEndpoint& endpoint,
                                             std::string_view offered) {
  if (endpoint.subprotocols.empty()) return std::string();
  std::vector<std::string_view> names = Split(offered, ',');
  for (std::string_view& name : names) name = Trim(name);
  for (const std::string& known : endpoint.subprotocols) {
    if (std::find(names.begin(), names.end(), known) != names.end()) return known;
  }
  return std::nullopt;
}

}  // namespace exemplar::http
