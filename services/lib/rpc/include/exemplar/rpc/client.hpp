#pragma once
// The interfaces of api/services.hpp, answered by a server elsewhere. gRPC stays behind this
// header.

#include <memory>
#include <string>

#include "exemplar/api/data.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/api/topics.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"
#include "exemplar/security/credentials.hpp"

namespace exemplar::rpc {

struct ClientOptions {
  /// HOST:PORT of a service or of the gateway.
  std::string server = "127.0.0.1:50051";
  /// Limit of each call but the long ones; zero: none. Over it: kDeadlineExceeded.
  Duration timeout = std::chrono::seconds(30);
  /// Limit of Learn, Execute and Plan, whose length depends on the work; zero: none.
  Duration long_timeout{0};
  /// A server that cannot be reached is tried for this long before a call fails with kUnavailable:
  /// helps programs that start at the same time. Zero: fail at the first refusal.
  Duration wait_for_server{0};
  /// Sent as `x-request-id` with a running number behind it; empty: one is made at random.
  std::string request_id = {};
  /// With a CA, TLS; the server's certificate must name the host of `server`.
  security::ClientCredentials credentials = {};
};

/// One connection to one server, shared by all clients. Whether the server has a service shows
/// when it is called: kUnavailable with the address where nobody answers, kUnimplemented where
/// that server does not serve it. Errors carry the code, message and field that the server gave.
struct Clients {
  std::unique_ptr<api::TrialApi> trials;
  std::unique_ptr<api::SkillApi> skills;
  std::unique_ptr<api::ExecutorApi> executor;
  std::unique_ptr<api::RecorderApi> recorder;
  std::unique_ptr<api::TopicApi> topics;  ///< of a gateway
  std::unique_ptr<api::DataApi> learning_data;
  std::unique_ptr<api::DataApi> recorder_data;
};

/// Does not wait for the server. Errors: an address that is none, credentials that cannot be read
/// or would cross a network in plain text.
Result<Clients> Connect(const ClientOptions& options);

/// One skill, asked again and again as its objects move, over one stream: a question costs less
/// than a call. Thread-compatible.
class MotionStream {
 public:
  virtual ~MotionStream() = default;
  /// An error of the question leaves the stream open; one of the connection is final.
  virtual Result<demonstration::SkillMotion> Ask(const demonstration::SkillQuery& query) = 0;
};

/// Errors: an address that is none. Whether the server answers shows at the first question.
Result<std::unique_ptr<MotionStream>> OpenMotionStream(const ClientOptions& options,
                                                       const std::string& skill, int version);

}  // namespace exemplar::rpc
