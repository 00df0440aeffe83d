#include "exemplar/rpc/server.hpp"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <fstream>
#include <limits>
#include <vector>

#include "exemplar/base/text.hpp"
#include "json_calls.hpp"
#include "proxy.hpp"
#include "server_call.hpp"
#include "server_settings.hpp"
#include "tls.hpp"

namespace exemplar::rpc {
namespace {

/// The host of HOST:PORT.
Result<std::string> HostOf(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) {
    return InvalidArgument("listen address \"" + address + "\" is not HOST:PORT", "listen");
  }
  const std::optional<long long> port = ParseInteger(std::string_view(address).substr(colon + 1));
  if (!port || *port < 0 || *port > 65535) {
    return InvalidArgument(
        "listen address \"" + address + "\": the port must be a number from 0 to 65535", "listen");
  }
  return address.substr(0, colon);
}

/// The full names of all services, the backends' among them.
std::vector<std::string> ServicesOf(const Services& services) {
  std::vector<std::string> names;
  if (services.trials) names.emplace_back("exemplar.v1.TrialService");
  if (services.skills) names.emplace_back("exemplar.v1.SkillService");
  if (services.executor) names.emplace_back("exemplar.v1.ExecutorService");
  if (services.recorder) names.emplace_back("exemplar.v1.RecorderService");
  if (services.topics) names.emplace_back("exemplar.v1.TopicService");
  if (services.learning_data) names.emplace_back("exemplar.v1.LearningDataService");
  if (services.recorder_data) names.emplace_back("exemplar.v1.RecorderDataService");
  for (const Backend& backend : services.backends) {
    names.insert(names.end(), backend.services.begin(), backend.services.end());
  }
  return names;
}

class GrpcServer final : public Server {
 public:
  explicit GrpcServer(const ServerOptions& options) : shared_(options) {}
  GrpcServer(const GrpcServer&) = delete;
  GrpcServer& operator=(const GrpcServer&) = delete;
  ~GrpcServer() override {
    if (server_) GrpcServer::Shutdown(std::chrono::seconds(1));
  }

  Status Start(const Services& services) {
    const ServerOptions& options = shared_.options();
    const Result<std::string> host = HostOf(options.listen);
    if (!host) return host.error();
    if (Status may = CheckListening(*host, options.credentials); !may) return may;
    const auto credentials = MakeServerCredentials(options.credentials);
    if (!credentials) return credentials.error();
    if (Status opened = shared_.guard().Open(); !opened) return opened;
    served_ = ServicesOf(services);
    if (services.trials) services_.push_back(MakeTrialService(shared_, *services.trials));
    if (services.skills) services_.push_back(MakeSkillService(shared_, *services.skills));
    if (services.executor) services_.push_back(MakeExecutorService(shared_, *services.executor));
    if (services.recorder) services_.push_back(MakeRecorderService(shared_, *services.recorder));
    if (services.topics) services_.push_back(MakeTopicService(shared_, *services.topics));
    if (services.learning_data) {
      services_.push_back(MakeLearningDataService(shared_, *services.learning_data));
    }
    if (services.recorder_data) {
      services_.push_back(MakeRecorderDataService(shared_, *services.recorder_data));
    }

    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    grpc::ServerBuilder builder;
    ApplySettings(builder);
    builder.SetMaxReceiveMessageSize(static_cast<int>(options.max_message_bytes));
    builder.AddListeningPort(options.listen, *credentials, &port_);
    for (const auto& service : services_) builder.RegisterService(service.get());
    if (!services.backends.empty()) {
      auto proxy = Proxy::Create(shared_, services.backends);
      if (!proxy) return proxy.error();
      proxy_ = std::move(*proxy);
      proxy_->AddTo(builder);
    }
    server_ = builder.BuildAndStart();
    if (!server_ || port_ <= 0) {
      return Unavailable("cannot listen on " + options.listen +
                         ": the port is taken, or the host is none of this machine's");
    }
    address_ = *host + ":" + std::to_string(port_);
    // The health service knows a name from its first status on; the proxy tells of its backends.
    Services own = services;
    own.backends.clear();
    for (const std::string& service : ServicesOf(own)) {
      server_->GetHealthCheckService()->SetServingStatus(service, true);
    }
    SetServing(true);
    if (proxy_) proxy_->Start(*server_->GetHealthCheckService());
    if (options.port_file.empty()) return {};
    return WritePortFile(options.port_file, port_);
  }

  int port() const override { return port_; }
  const std::string& address() const override { return address_; }

  void SetServing(bool serving) override {
    server_->GetHealthCheckService()->SetServingStatus(serving);
    if (proxy_ && serving) proxy_->ReportHealth();
  }

  std::unique_ptr<api::JsonCalls> MakeJsonCalls() override {
    grpc::ChannelArguments arguments;
    arguments.SetMaxReceiveMessageSize(std::numeric_limits<int>::max());
    return rpc::MakeJsonCalls(server_->InProcessChannel(arguments), served_);
  }

  std::vector<BackendState> backends() const override {
    return proxy_ ? proxy_->states() : std::vector<BackendState>();
  }

  void Shutdown(Duration grace) override {
    shared_.shutdown().request_stop();
    if (proxy_) proxy_->Stop();
    // Those who watch the health let go, so that nobody waits for them.
    if (auto* health = server_->GetHealthCheckService()) health->Shutdown();
    server_->Shutdown(std::chrono::system_clock::now() +
                      std::chrono::duration_cast<std::chrono::system_clock::duration>(grace));
  }

 private:
  ServerShared shared_;
  std::vector<std::string> served_;
  std::vector<std::unique_ptr<grpc::Service>> services_;
  std::unique_ptr<Proxy> proxy_;  ///< outlives the server, whose calls it answers
  std::unique_ptr<grpc::Server> server_;
  int port_ = 0;
  std::string address_;
};

}  // namespace

Status WritePortFile(const std::filesystem::path& file, int port) {
  std::filesystem::path part = file;
  part += ".part";
  {
    std::ofstream out(part, std::ios::trunc);
    out << port << "\n";
    out.flush();
    if (!out) return InvalidArgument(part.string() + ": cannot be written", "port_file");
  }
  std::error_code error;
  std::filesystem::rename(part, file, error);
  if (error) return InvalidArgument(file.string() + ": " + error.message(), "port_file");
  return {};
}

Status CheckListenAddress(const std::string& address,
                          const security::ServerCredentials& credentials) {
  const Result<std::string> host = HostOf(address);
  return host ? CheckListening(*host, credentials) : host.error();
}

Result<std::unique_ptr<Server>> Server::Create(const ServerOptions& options,
                                               const Services& services) {
  auto server = std::make_unique<GrpcServer>(options);
  if (const Status status = server->Start(services); !status) return status.error();
  return std::unique_ptr<Server>(std::move(server));
}

}  // namespace exemplar::rpc
