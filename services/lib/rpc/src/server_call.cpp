#include "server_call.hpp"

#include <chrono>

#include "call_status.hpp"
#include "convert_common.hpp"
#include "exemplar/base/ids.hpp"

namespace exemplar::rpc {
namespace {

std::string RequestId(const grpc::ServerContext& context) {
  constexpr std::size_t kLongest = 128;
  const auto found = context.client_metadata().find("x-request-id");
  if (found == context.client_metadata().end()) return {};
  return Utf8({found->second.data(), found->second.size()}, kLongest);
}

Status Guarded(const std::function<Status()>& body) {
  try {
    return body();
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kResourceExhausted, "out of memory"};
  } catch (const std::exception& e) {
    return Internal(std::string("unexpected fault: ") + e.what());
  }
}

}  // namespace

ServerShared::ServerShared(const ServerOptions& options) : options_(options), rng_(EntropySeed()) {}

std::string ServerShared::MakeRequestId() {
  const std::lock_guard lock(mutex_);
  return MakeId("request", rng_);
}

grpc::Status Serve(ServerShared& shared, grpc::ServerContext& context, std::string_view method,
                   const std::function<Status()>& body) {
  const auto start = std::chrono::steady_clock::now();
  Status status = Guarded(body);
  if (!status && status.error().code == ErrorCode::kCancelled &&
      shared.shutdown().stop_requested()) {
    status = Unavailable("the server is shutting down");
  }
  if (shared.options().on_call) {
    std::string id = RequestId(context);
    if (id.empty()) id = shared.MakeRequestId();
    const std::string peer = context.peer();
    shared.options().on_call({.method = method,
                              .request_id = id,
                              .peer = peer,
                              .status = status,
                              .duration = std::chrono::steady_clock::now() - start});
  }
  return ToGrpc(status);
}

CancellationWatch::CancellationWatch(ServerShared& shared, grpc::ServerContext& context)
    : on_shutdown_(shared.shutdown().get_token(), [this] { stop_.request_stop(); }),
      thread_([this, &context](const std::stop_token& done) {
        constexpr auto kPeriod = std::chrono::milliseconds(20);
        std::mutex mutex;
        std::condition_variable_any wake;
        std::unique_lock lock(mutex);
        while (!done.stop_requested()) {
          if (context.IsCancelled()) {
            stop_.request_stop();
            return;
          }
          wake.wait_for(lock, done, kPeriod, [] { return false; });
        }
      }) {}

}  // namespace exemplar::rpc
