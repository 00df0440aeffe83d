#include "server_call.hpp"

#include <chrono>

#include "call_status.hpp"
#include "convert_common.hpp"
#include "exemplar/base/ids.hpp"
#include "exemplar/base/text.hpp"

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

ServerShared::ServerShared(const ServerOptions& options)
    : options_(options), guard_(options_), deadlines_(options.max_call), rng_(EntropySeed()) {}

std::string ServerShared::MakeRequestId() {
  const std::lock_guard lock(mutex_);
  return MakeId("request", rng_);
}

std::string WhoCalls(const grpc::ServerContext& context) {
  const std::string request = RequestId(context);
  return request.empty() ? "from " + context.peer() : request;
}

grpc::Status Serve(ServerShared& shared, grpc::ServerContext& context, std::string_view method,
                   std::string_view target, const std::function<Status()>& body) {
  const auto start = std::chrono::steady_clock::now();
  const MethodRule* rule = RuleOf(method);
  const Admission admission = shared.guard().Admit(context, method, rule);
  const auto report = [&](const Status& status, std::string_view outcome) {
    if (!shared.options().on_call) return;
    std::string id = RequestId(context);
    if (id.empty()) id = shared.MakeRequestId();
    const std::string peer = context.peer();
    constexpr std::size_t kLongestTarget = 128;
    const std::string about = Utf8(target, kLongestTarget);
    shared.options().on_call({.method = method,
                              .request_id = id,
                              .peer = peer,
                              .caller = admission.caller,
                              .target = about,
                              .outcome = outcome,
                              .audited = rule != nullptr && rule->audited,
                              .status = status,
                              .duration = std::chrono::steady_clock::now() - start});
  };
  if (admission.refusal) {
    report(admission.refusal->error, admission.refusal->outcome);
    return ToGrpc(admission.refusal->error);
  }
  Status status;
  {
    std::optional<CallDeadlines::Watch> watch;
    const Duration longest = shared.options().max_call;
    if (rule->length == CallLength::kShort && longest > Duration::zero()) {
      watch.emplace(shared.deadlines(), context);
    }
    status = Guarded(body);
    if (watch && watch->fired()) {
      status = Error{ErrorCode::kDeadlineExceeded, "the call took more than " +
                                                       FormatDouble(ToSeconds(longest)) +
                                                       " s, the most that this server gives it"};
    }
  }
  if (!status && status.error().code == ErrorCode::kCancelled &&
      shared.shutdown().stop_requested()) {
    status = Unavailable("the server is shutting down");
  }
  report(status, status ? "ok" : ToString(status.error().code));
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
