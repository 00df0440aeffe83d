#pragma once
#include <string>
#include <vector>

#include "exemplar/api/json_calls.hpp"

namespace exemplar::rpc {

/// An OpenAPI 3.0 document of the methods, from their descriptors.
std::string OpenApiOf(const std::vector<api::JsonMethod>& methods);

}  // namespace exemplar::rpc
