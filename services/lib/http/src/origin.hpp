#pragma once
// Which web pages may use the server.

#include <string_view>

#include "exemplar/http/server.hpp"

namespace exemplar::http {

/// `origin` and `host` as the headers of that name have them. A page of the same host is let in
/// under an address or as localhost, and under any name over TLS, where the certificate is for that
/// name: in plain text, a name could be made to point here by whoever owns it.
bool MayUse(const Origins& origins, std::string_view origin, std::string_view host,
            bool tls = false);

}  // namespace exemplar::http
