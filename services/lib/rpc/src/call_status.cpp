#include "call_status.hpp"

#include "convert_common.hpp"

namespace exemplar::rpc {
namespace {

grpc::StatusCode CodeOf(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
      return grpc::StatusCode::INVALID_ARGUMENT;
    case ErrorCode::kNotFound:
      return grpc::StatusCode::NOT_FOUND;
    case ErrorCode::kAlreadyExists:
      return grpc::StatusCode::ALREADY_EXISTS;
    case ErrorCode::kFailedPrecondition:
      return grpc::StatusCode::FAILED_PRECONDITION;
    case ErrorCode::kUnavailable:
      return grpc::StatusCode::UNAVAILABLE;
    case ErrorCode::kResourceExhausted:
      return grpc::StatusCode::RESOURCE_EXHAUSTED;
    case ErrorCode::kDeadlineExceeded:
      return grpc::StatusCode::DEADLINE_EXCEEDED;
    case ErrorCode::kCancelled:
      return grpc::StatusCode::CANCELLED;
    case ErrorCode::kDataLoss:
      return grpc::StatusCode::DATA_LOSS;
    case ErrorCode::kInternal:
      return grpc::StatusCode::INTERNAL;
    case ErrorCode::kUnauthenticated:
      return grpc::StatusCode::UNAUTHENTICATED;
    case ErrorCode::kPermissionDenied:
      return grpc::StatusCode::PERMISSION_DENIED;
    case ErrorCode::kUnimplemented:
      return grpc::StatusCode::UNIMPLEMENTED;
  }
  return grpc::StatusCode::INTERNAL;
}

/// What may be wrong where a connection was made and broke at once.
std::string HintOf(const std::string& message) {
  const auto says = [&message](const char* words) {
    return message.find(words) != std::string::npos;
  };
  if (says("certificate verify failed")) {
    return " (the server's certificate is not of --tls-ca, or has expired)";
  }
  if (says("handshak") || says("SSL") || says("Peer name")) {
    return " (does the server want TLS, and a certificate of the caller?)";
  }
  if (says("Socket closed") || says("reset by peer") || says("Broken pipe") ||
      says("Endpoint closing")) {
    return " (if the server wants TLS: --tls-ca)";
  }
  return {};
}

ErrorCode CodeOf(grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::OUT_OF_RANGE:
      return ErrorCode::kInvalidArgument;
    case grpc::StatusCode::NOT_FOUND:
      return ErrorCode::kNotFound;
    case grpc::StatusCode::ALREADY_EXISTS:
      return ErrorCode::kAlreadyExists;
    case grpc::StatusCode::FAILED_PRECONDITION:
    case grpc::StatusCode::ABORTED:
      return ErrorCode::kFailedPrecondition;
    case grpc::StatusCode::UNAVAILABLE:
      return ErrorCode::kUnavailable;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return ErrorCode::kResourceExhausted;
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return ErrorCode::kDeadlineExceeded;
    case grpc::StatusCode::CANCELLED:
      return ErrorCode::kCancelled;
    case grpc::StatusCode::DATA_LOSS:
      return ErrorCode::kDataLoss;
    case grpc::StatusCode::UNAUTHENTICATED:
      return ErrorCode::kUnauthenticated;
    case grpc::StatusCode::PERMISSION_DENIED:
      return ErrorCode::kPermissionDenied;
    case grpc::StatusCode::UNIMPLEMENTED:
      return ErrorCode::kUnimplemented;
    default:
      return ErrorCode::kInternal;
  }
}

/// What is said of an error without our detail: it came from gRPC itself or a server that is not
/// ours.
std::string MessageOf(const grpc::Status& status, const std::string& address) {
  const std::string& said = status.error_message();
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      return "no answer from " + address + ": " + PlainReason(said) + HintOf(said);
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return address + " did not answer in time";
    case grpc::StatusCode::CANCELLED:
      return "the call to " + address + " was cancelled";
    case grpc::StatusCode::UNIMPLEMENTED:
      return address + " does not serve this call" + (said.empty() ? "" : ": " + said);
    default:
      return address + ": " + said;
  }
}

}  // namespace

std::string PlainReason(const std::string& said) {
  struct Reason {
    const char* words;
    const char* plainly;
  };
  for (const Reason& reason : {Reason{"DNS resolution failed", "no machine of that name is known"},
                               Reason{"Connection refused", "nobody listens there"},
                               Reason{"No route to host", "there is no way to that machine"},
                               Reason{"Network is unreachable", "there is no way to that network"},
                               Reason{"Connection timed out", "that machine does not answer"}}) {
    if (said.find(reason.words) != std::string::npos) return reason.plainly;
  }
  return said;
}

grpc::Status ToGrpc(const Status& status) {
  if (status) return grpc::Status::OK;
  const grpc::StatusCode code = CodeOf(status.error().code);
  v1::ErrorDetail detail;
  ToProto(status.error(), &detail);
  v1::CallStatus all;
  all.set_code(code);
  all.set_message(detail.message());
  all.add_details()->PackFrom(detail);
  return {code, detail.message(), all.SerializeAsString()};
}

Error FromGrpc(const grpc::Status& status, const std::string& address) {
  v1::CallStatus all;
  if (!status.error_details().empty() && all.ParseFromString(status.error_details())) {
    for (const google::protobuf::Any& any : all.details()) {
      v1::ErrorDetail detail;
      if (!any.UnpackTo(&detail)) continue;
      Error error = FromProto(detail);
      if (!ParseErrorCode(detail.code())) error.code = CodeOf(status.error_code());
      return error;
    }
  }
  return {CodeOf(status.error_code()), MessageOf(status, address)};
}

}  // namespace exemplar::rpc
