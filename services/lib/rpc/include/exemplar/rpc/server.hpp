#pragma once
// Serves the interfaces of api/services.hpp over gRPC. gRPC itself stays behind this header.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/api/data.hpp"
#include "exemplar/api/json_calls.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/api/topics.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"
#include "exemplar/rpc/client.hpp"
#include "exemplar/security/credentials.hpp"

namespace exemplar::rpc {

/// Another server, to which calls of its services are passed on.
struct Backend {
  std::string name;                   ///< "executor", as errors and metrics call it
  ClientOptions connection;           ///< where it is, and how it is to be called; no time limits
  std::vector<std::string> services;  ///< "exemplar.v1.ExecutorService"
};

struct BackendState {
  std::string name;
  std::string address;
  std::vector<std::string> services;
  bool serving = false;  ///< as its health service says; false when it does not answer
};

/// What a server serves: any subset. The objects must outlive the server.
struct Services {
  api::TrialApi* trials = nullptr;
  api::SkillApi* skills = nullptr;
  api::ExecutorApi* executor = nullptr;
  api::RecorderApi* recorder = nullptr;
  api::TopicApi* topics = nullptr;
  api::DataApi* learning_data = nullptr;
  api::DataApi* recorder_data = nullptr;
  /// Their calls go on with deadline, cancellation and metadata, message by message; health and
  /// reflection speak for them. Methods that are newer than this server go on as well.
  std::vector<Backend> backends = {};
};

/// One finished call, for logs and metrics.
struct CallRecord {
  std::string_view method = {};      ///< "exemplar.v1.SkillService/Query"
  std::string_view request_id = {};  ///< the caller's `x-request-id`, else one made here
  std::string_view peer = {};        ///< "ipv4:127.0.0.1:40312"
  std::string_view caller = {};      ///< the caller's name; empty where nobody has to have one
  std::string_view target = {};      ///< what the call was about ("press"), where it is audited
  /// "ok", the name of the ErrorCode, or "rate_limited".
  std::string_view outcome = {};
  bool audited = false;  ///< moves the robot or deletes: who did it must be known later
  Status status = {};
  Duration duration{0};
};

struct ServerOptions {
  /// HOST:PORT; port 0 picks a free one.
  std::string listen = "127.0.0.1:0";
  /// Gets the port as decimal text, written whole or not at all, once the server answers. Empty:
  /// none.
  std::filesystem::path port_file = {};
  /// Larger requests are refused with RESOURCE_EXHAUSTED; files travel in chunks far below it.
  std::size_t max_message_bytes = std::size_t{64} << 20;
  /// Larger files are refused while they are sent.
  std::size_t max_file_bytes = std::size_t{1} << 30;
  /// Calls whose length does not depend on the work are cancelled after this; zero: never.
  Duration max_call = std::chrono::minutes(2);
  /// TLS, who may call, how often.
  security::ServerCredentials credentials = {};
  /// Hears when the access file or a certificate cannot be read again; null: nobody. Outlives the
  /// server.
  Log* log = nullptr;
  /// Called at the end of each call, from the call's thread: must be thread-safe and quick.
  std::function<void(const CallRecord&)> on_call = {};
};

/// Whether a server with these credentials may listen on HOST:PORT, as Server::Create decides it:
/// for servers of other protocols beside it.
Status CheckListenAddress(const std::string& address,
                          const security::ServerCredentials& credentials);

/// Writes the port as decimal text, whole or not at all.
Status WritePortFile(const std::filesystem::path& file, int port);

/// A running gRPC server with the health service (status of "" and of each service by its full
/// name) and reflection. A caller who goes away, cancels or runs out of time requests the stop of
/// the stop_token that the interface's method got. Thread-safe.
class Server {
 public:
  /// Listens when it returns. Errors name the address, the port file, or the option of the
  /// credentials. An address beyond loopback is refused unless callers come with TLS and are known
  /// by certificate or token, or the credentials say that it may be insecure.
  static Result<std::unique_ptr<Server>> Create(const ServerOptions& options,
                                                const Services& services);
  /// As Shutdown(1 s).
  virtual ~Server() = default;

  virtual int port() const = 0;
  /// "127.0.0.1:40001": as listened on, with the real port.
  virtual const std::string& address() const = 0;
  /// Those of Services::backends.
  virtual std::vector<BackendState> backends() const = 0;
  /// Every call that is served here, as JSON; made within the process, and let in, logged and
  /// counted as those of the network. The server outlives it.
  virtual std::unique_ptr<api::JsonCalls> MakeJsonCalls() = 0;
  /// The health service answers NOT_SERVING from here on (or SERVING again).
  virtual void SetServing(bool serving) = 0;
  /// Refuses new calls, requests the stop of those that run, waits up to `grace` and then cuts the
  /// rest off. Returns when no call runs any more. May be called repeatedly.
  virtual void Shutdown(Duration grace) = 0;
};

}  // namespace exemplar::rpc
