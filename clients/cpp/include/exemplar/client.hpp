#pragma once
// The client library in one header: connect to a service or to the gateway, submit trials, learn,
// ask, execute, record.
//
//   const auto clients = exemplar::rpc::Connect({.server = "127.0.0.1:50051"});
//   const auto report = clients->skills->Learn("press", {}, {}, {});
//
// Calls return Result<T> (base/result.hpp): a value, or an Error with code, message and the field
// at fault. What each service offers stands in api/services.hpp, the values in demonstration/ and
// learning/. Lengths are in m, angles in rad, times in s.

#include "exemplar/api/services.hpp"
#include "exemplar/demonstration/csv.hpp"
#include "exemplar/rpc/client.hpp"

namespace exemplar::client {

/// Of this library: "0.1.0".
const char* Version();

}  // namespace exemplar::client
