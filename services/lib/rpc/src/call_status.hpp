#pragma once
#include <grpcpp/support/status.h>

#include <string>

#include "exemplar/base/result.hpp"

namespace exemplar::rpc {

/// The standard code and message, with an ErrorDetail that names the field.
grpc::Status ToGrpc(const Status& status);
/// What gRPC says of a connection that could not be made, in few words.
std::string PlainReason(const std::string& said);
/// The Error that the server had, or what the transport says. Where the server is of another
/// version and its code has a name that is not known here, gRPC's code counts. Precondition:
/// !status.ok().
Error FromGrpc(const grpc::Status& status, const std::string& address);

}  // namespace exemplar::rpc
