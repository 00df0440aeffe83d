#include "exemplar/rpc/client.hpp"

#include <grpcpp/create_channel.h>

#include <chrono>
#include <limits>

#include "client_call.hpp"
#include "exemplar/base/ids.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/rpc/metadata.hpp"

namespace exemplar::rpc {
namespace {

using SystemTime = std::chrono::system_clock;

SystemTime::time_point After(Duration wait) {
  return SystemTime::now() + std::chrono::duration_cast<SystemTime::duration>(wait);
}

std::string MakeRequestId(const ClientOptions& options) {
  if (!options.request_id.empty()) return options.request_id;
  Rng rng(EntropySeed());
  return MakeId("request", rng);
}

std::shared_ptr<grpc::Channel> MakeChannel(
    const std::string& server, const std::shared_ptr<grpc::ChannelCredentials>& credentials) {
  grpc::ChannelArguments arguments;
  // A proxy set for the browser must not come between a robot and its services.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  arguments.SetMaxReceiveMessageSize(std::numeric_limits<int>::max());
  return grpc::CreateCustomChannel(server, credentials, arguments);
}

}  // namespace

Connection::Connection(const ClientOptions& options, const ChannelSecurity& security)
    : options_(options),
      request_id_(MakeRequestId(options)),
      authorization_(security.token.empty() ? "" : "Bearer " + security.token),
      channel_(MakeChannel(options.server, security.credentials)) {}

Result<std::shared_ptr<Connection>> Connection::Create(const ClientOptions& options) {
  const std::string& server = options.server;
  const std::size_t colon = server.rfind(':');
  const std::optional<long long> port =
      colon == std::string::npos ? std::nullopt
                                 : ParseInteger(std::string_view(server).substr(colon + 1));
  if (colon == 0 || !port || *port < 1 || *port > 65535) {
    return InvalidArgument("server address \"" + server + "\" is not HOST:PORT", "server");
  }
  const Result<ChannelSecurity> security =
      MakeChannelSecurity(server.substr(0, colon), options.credentials);
  if (!security) return security.error();
  return std::shared_ptr<Connection>(new Connection(options, *security));
}

std::unique_ptr<grpc::ClientContext> Connection::Begin(Length length) {
  if (options_.wait_for_server > Duration::zero()) {
    channel_->WaitForConnected(After(options_.wait_for_server));
  }
  auto context = std::make_unique<grpc::ClientContext>();
  const Duration limit = length == Length::kShort  ? options_.timeout
                         : length == Length::kLong ? options_.long_timeout
                                                   : Duration::zero();
  if (limit > Duration::zero()) context->set_deadline(After(limit));
  context->AddMetadata(kRequestIdKey, request_id_ + "-" + std::to_string(++calls_));
  if (!authorization_.empty()) context->AddMetadata(kAuthorizationKey, authorization_);
  return context;
}

Result<Clients> Connect(const ClientOptions& options) {
  Result<std::shared_ptr<Connection>> connection = Connection::Create(options);
  if (!connection) return connection.error();
  Clients clients;
  clients.trials = MakeTrialClient(*connection);
  clients.skills = MakeSkillClient(*connection);
  clients.executor = MakeExecutorClient(*connection);
  clients.recorder = MakeRecorderClient(*connection);
  clients.topics = MakeTopicClient(*connection);
  clients.learning_data = MakeLearningDataClient(*connection);
  clients.recorder_data = MakeRecorderDataClient(*connection);
  return clients;
}

}  // namespace exemplar::rpc
