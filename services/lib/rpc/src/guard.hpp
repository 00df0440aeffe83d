#pragma once
// Who calls, whether he may, how often, and for how long.

#include <grpcpp/server_context.h>

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>

#include "exemplar/base/clock.hpp"
#include "exemplar/rpc/method_rules.hpp"
#include "exemplar/rpc/server.hpp"
#include "exemplar/security/access.hpp"
#include "exemplar/security/rate_limit.hpp"

namespace exemplar::rpc {

/// Why a call is not let in.
struct Refusal {
  std::string_view outcome;  ///< as CallRecord has it
  Error error;
};

/// What became of a call at the door.
struct Admission {
  std::string caller;  ///< empty where nobody has to have a name
  std::optional<Refusal> refusal;
};

/// Thread-safe.
class Guard {
 public:
  explicit Guard(const ServerOptions& options);
  /// Once, before the first call: reads the access file.
  Status Open();
  /// Whether the call may go on. `rule` may be null: then not.
  Admission Admit(const grpc::ServerContextBase& context, std::string_view method,
                  const MethodRule* rule);

 private:
  Result<security::Caller> Identify(const grpc::ServerContextBase& context);

  const SystemClock clock_;
  NullLog null_log_;
  const ServerOptions& options_;
  security::RateLimiter limiter_;
  std::unique_ptr<security::AccessFile> access_;
};

/// Cancels calls that take too long. Thread-safe.
class CallDeadlines {
 public:
  explicit CallDeadlines(Duration longest);
  CallDeadlines(const CallDeadlines&) = delete;
  CallDeadlines& operator=(const CallDeadlines&) = delete;

  /// For as long as it lives, the call is watched.
  class Watch {
   public:
    Watch(CallDeadlines& deadlines, grpc::ServerContext& context);
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;
    ~Watch();
    /// The call was cancelled for its length.
    bool fired() const;

   private:
    friend class CallDeadlines;
    CallDeadlines& deadlines_;
    grpc::ServerContext& context_;
    bool fired_ = false;
    std::multimap<Duration, Watch*>::iterator place_;
  };

 private:
  void Run(const std::stop_token& stop);

  const Duration longest_;
  const SystemClock clock_;
  std::mutex mutex_;  ///< guards what follows, and the watches' fired_
  std::condition_variable_any added_;
  std::multimap<Duration, Watch*> watches_;  ///< by the steady time of their end
  std::jthread thread_;
};

}  // namespace exemplar::rpc
