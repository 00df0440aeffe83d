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

/// What an error without our detail means: it came from gRPC itself or a server that is not ours.
Error WithoutDetail(const grpc::Status& status, const std::string& address) {
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      return Unavailable("no answer from " + address + ": " + status.error_message() +
                         HintOf(status.error_message()));
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return {ErrorCode::kDeadlineExceeded, address + " did not answer in time"};
    case grpc::StatusCode::CANCELLED:
      return {ErrorCode::kCancelled, "the call to " + address + " was cancelled"};
    case grpc::StatusCode::UNIMPLEMENTED:
      return FailedPrecondition(address + " does not serve this call: " + status.error_message());
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return {ErrorCode::kResourceExhausted, address + ": " + status.error_message()};
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::OUT_OF_RANGE:
      return InvalidArgument(address + ": " + status.error_message());
    case grpc::StatusCode::NOT_FOUND:
      return NotFound(address + ": " + status.error_message());
    case grpc::StatusCode::ALREADY_EXISTS:
      return {ErrorCode::kAlreadyExists, address + ": " + status.error_message()};
    case grpc::StatusCode::FAILED_PRECONDITION:
    case grpc::StatusCode::ABORTED:
    case grpc::StatusCode::PERMISSION_DENIED:
    case grpc::StatusCode::UNAUTHENTICATED:
      return FailedPrecondition(address + ": " + status.error_message());
    case grpc::StatusCode::DATA_LOSS:
      return {ErrorCode::kDataLoss, address + ": " + status.error_message()};
    default:
      return Internal(address + ": " + status.error_message());
  }
}

}  // namespace

grpc::Status ToGrpc(const Status& status) {
  return status ? grpc::Status::OK : ToGrpc(status.error(), CodeOf(status.error().code));
}

grpc::Status ToGrpc(const Error& error, grpc::StatusCode code) {
  v1::ErrorDetail detail;
  ToProto(error, &detail);
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
      if (any.UnpackTo(&detail)) return FromProto(detail);
    }
  }
  return WithoutDetail(status, address);
}

}  // namespace exemplar::rpc
