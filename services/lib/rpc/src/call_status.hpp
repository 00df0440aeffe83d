#pragma once
#include <grpcpp/support/status.h>

#include <string>

#include "exemplar/base/result.hpp"

namespace exemplar::rpc {

/// The standard code and message, with an ErrorDetail that names the field.
grpc::Status ToGrpc(const Status& status);
/// The same for an error that gRPC has a code of its own for.
grpc::Status ToGrpc(const Error& error, grpc::StatusCode code);
/// The Error that the server had, or what the transport says. Precondition: !status.ok().
Error FromGrpc(const grpc::Status& status, const std::string& address);

}  // namespace exemplar::rpc
