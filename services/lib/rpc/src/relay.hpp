#pragma once
#include <grpcpp/generic/async_generic_service.h>

#include <functional>
#include <map>
#include <memory>
#include <stop_token>
#include <string>

#include "client_call.hpp"

namespace exemplar::rpc {

using RelayReactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;

/// Ends a call at once.
RelayReactor* RefuseCall(const grpc::Status& status);

struct RelayOptions {
  std::string method;                      ///< "/exemplar.v1.SkillService/Query"
  std::shared_ptr<Connection> connection;  ///< outlives the call
  /// Sent beside what the caller sent, and instead of it where the name is the same.
  std::map<std::string, std::string> metadata;
  bool pass_authorization = true;
  std::stop_token stop;  ///< cancels the call
  /// What the caller gets, of what the backend said.
  std::function<grpc::Status(const grpc::Status&)> translate;
  /// Once, when the call is over.
  std::function<void(const grpc::Status&)> on_done;
};

/// Passes a call on, in both directions as fast as the slower side takes it: at most one message of
/// each direction is held. Deadline and cancellation go along. Deletes itself.
RelayReactor* StartRelay(grpc::CallbackServerContext& context, RelayOptions options);

}  // namespace exemplar::rpc
