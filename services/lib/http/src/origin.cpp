#include "origin.hpp"

#include <algorithm>

namespace exemplar::http {
namespace {

bool IsAddressOrLocal(std::string_view host) {
  if (host.starts_with('[')) return host.find(']') != std::string_view::npos;
  const std::string_view name = host.substr(0, host.rfind(':'));
  if (name == "localhost") return true;
  return !name.empty() && name.find_first_not_of("0123456789.") == std::string_view::npos &&
         std::count(name.begin(), name.end(), '.') == 3;
}

}  // namespace

bool MayUse(const Origins& origins, std::string_view origin, std::string_view host, bool tls) {
  for (const std::string& allowed : origins.allowed) {
    if (allowed == "*" || allowed == origin) return true;
  }
  const std::size_t scheme = origin.find("://");
  if (scheme == std::string_view::npos || origin.substr(scheme + 3) != host) return false;
  return IsAddressOrLocal(host) || (tls && origin.starts_with("https://"));
}

}  // namespace exemplar::http
