#pragma once
// Which web pages may use the server.

#include <string_view>

#include "exemplar/http/server.hpp"

namespace exemplar::http {

/// `origin` and `host` as the headers of that name have them. A page of the same host is let in
/// only under an address or as localhost: any other name could be made to point here by whoever
/// owns it.
bool MayUse(const Origins& origins, std::string_view origin, std::string_view host);

}  // namespace exemplar::http
