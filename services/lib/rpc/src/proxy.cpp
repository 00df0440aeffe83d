#include "proxy.hpp"

#include <google/protobuf/descriptor.h>
#include <grpcpp/impl/rpc_service_method.h>
#include <grpcpp/impl/service_type.h>

#include <chrono>
#include <utility>

#include "call_status.hpp"
#include "convert_common.hpp"
#include "exemplar/rpc/metadata.hpp"
#include "health_watch.hpp"
#include "relay.hpp"
#include "tls.hpp"

namespace exemplar::rpc {
namespace {

constexpr int kMostCalls = 1024;
/// All that the calls under way may hold.
constexpr std::size_t kMostMemory = std::size_t{512} << 20;

/// "exemplar.v1.SkillService" of "exemplar.v1.SkillService/Query".
std::string_view ServiceOf(std::string_view method) { return method.substr(0, method.rfind('/')); }

grpc::Status NotServed(const std::string& why) { return {grpc::StatusCode::UNIMPLEMENTED, why}; }

/// What is said of a call when it is over.
class CallMark {
 public:
  CallMark(ServerShared& shared, const grpc::CallbackServerContext& context, std::string method)
      : shared_(shared), method_(std::move(method)), peer_(context.peer()) {
    constexpr std::size_t kLongest = 128;
    const auto found = context.client_metadata().find(kRequestIdKey);
    if (found != context.client_metadata().end()) {
      request_id_ = Utf8({found->second.data(), found->second.size()}, kLongest);
    }
    if (request_id_.empty()) request_id_ = shared_.MakeRequestId();
  }
  const std::string& request_id() const { return request_id_; }
  void SetCaller(std::string caller) { caller_ = std::move(caller); }

  void End(const Status& status, std::string_view outcome) const {
    if (!shared_.options().on_call) return;
    const MethodRule* const rule = RuleOf(method_);
    shared_.options().on_call({.method = method_,
                               .request_id = request_id_,
                               .peer = peer_,
                               .caller = caller_,
                               .outcome = outcome,
                               .audited = rule != nullptr && rule->audited,
                               .status = status,
                               .duration = std::chrono::steady_clock::now() - start_});
  }

 private:
  ServerShared& shared_;
  std::string method_;
  std::string peer_;
  std::string request_id_;
  std::string caller_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

/// A backend's service with all the methods that its descriptor here has.
class RelayedService final : public grpc::Service {
 public:
  RelayedService(Proxy& proxy, const google::protobuf::ServiceDescriptor& descriptor) {
    for (int i = 0; i < descriptor.method_count(); ++i) {
      names_.push_back("/" + descriptor.full_name() + "/" + descriptor.method(i)->name());
    }
    for (std::size_t i = 0; i < names_.size(); ++i) {
      using Handler = grpc::internal::CallbackBidiHandler<grpc::ByteBuffer, grpc::ByteBuffer>;
      // gRPC takes ownership of both. On the wire every call is a stream in both directions.
      AddMethod(new grpc::internal::RpcServiceMethod(
          names_[i].c_str(), grpc::internal::RpcMethod::BIDI_STREAMING, nullptr));
      MarkMethodRawCallback(static_cast<int>(i),
                            new Handler([&proxy, method = std::string_view(names_[i]).substr(1)](
                                            grpc::CallbackServerContext* context) {
                              return proxy.Relay(*context, method);
                            }));
    }
  }

 private:
  std::vector<std::string> names_;
};

Result<std::unique_ptr<Proxy>> Proxy::Create(ServerShared& shared,
                                             const std::vector<Backend>& backends) {
  std::unique_ptr<Proxy> proxy(new Proxy(shared));
  for (const Backend& backend : backends) {
    Result<std::shared_ptr<Connection>> connection = Connection::Create(backend.connection);
    if (!connection) return WithPlace(connection.error(), backend.name);
    auto link = std::make_unique<BackendLink>();
    link->name = backend.name;
    link->connection = std::move(*connection);
    const std::string& server = backend.connection.server;
    link->may_hear_secrets = !backend.connection.credentials.ca.empty() ||
                             IsLoopback(std::string_view(server).substr(0, server.rfind(':')));
    link->speaks_for_others = !backend.connection.credentials.certificate.empty();
    for (const std::string& service : backend.services) {
      if (!proxy->by_service_.emplace(service, link.get()).second) {
        return InvalidArgument("two backends serve " + service, backend.name);
      }
      const auto* descriptor =
          google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(service);
      if (descriptor == nullptr) {
        return InvalidArgument("no service is called " + service, backend.name);
      }
      proxy->services_.push_back(std::make_unique<RelayedService>(*proxy, *descriptor));
    }
    proxy->serving_[link.get()] = false;
    proxy->backends_.push_back(std::move(link));
  }
  return proxy;
}

Proxy::Proxy(ServerShared& shared) : shared_(shared) {}

Proxy::~Proxy() { Stop(); }

void Proxy::AddTo(grpc::ServerBuilder& builder) {
  for (const auto& service : services_) builder.RegisterService(service.get());
  builder.RegisterCallbackGenericService(&rest_);
  builder.SetResourceQuota(grpc::ResourceQuota("gateway").Resize(kMostMemory));
}

void Proxy::Start(grpc::HealthCheckServiceInterface& health) {
  {
    const std::lock_guard lock(mutex_);
    health_ = &health;
  }
  ReportHealth();
  for (const auto& backend : backends_) {
    watches_.push_back(std::make_unique<HealthWatch>(
        backend->connection,
        [this, link = backend.get()](bool serving) { SetServing(*link, serving); }));
  }
}

void Proxy::Stop() {
  watches_.clear();
  const std::lock_guard lock(mutex_);
  health_ = nullptr;
}

void Proxy::SetServing(const BackendLink& backend, bool serving) {
  {
    const std::lock_guard lock(mutex_);
    serving_[&backend] = serving;
  }
  ReportHealth();
}

void Proxy::ReportHealth() {
  const std::lock_guard lock(mutex_);
  if (health_ == nullptr || shared_.shutdown().stop_requested()) return;
  for (const auto& [service, backend] : by_service_) {
    health_->SetServingStatus(service, serving_[backend]);
  }
}

std::vector<BackendState> Proxy::states() const {
  const std::lock_guard lock(mutex_);
  std::vector<BackendState> states;
  for (const auto& backend : backends_) {
    BackendState& state = states.emplace_back();
    state.name = backend->name;
    state.address = backend->connection->address();
    state.serving = serving_.at(backend.get());
    for (const auto& [service, link] : by_service_) {
      if (link == backend.get()) state.services.push_back(service);
    }
  }
  return states;
}

grpc::ServerGenericBidiReactor* Proxy::Rest::CreateReactor(
    grpc::GenericCallbackServerContext* context) {
  const std::string& path = context->method();
  return proxy_.Relay(*context, std::string_view(path).substr(path.starts_with('/') ? 1 : 0));
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Proxy::Relay(
    grpc::CallbackServerContext& context, std::string_view method) {
  const auto backend = by_service_.find(ServiceOf(method));
  // Names that callers make up must not fill logs and metrics.
  const MethodRule* const listed = RuleOf(method);
  CallMark mark(shared_, context,
                listed != nullptr              ? std::string(method)
                : backend != by_service_.end() ? backend->first + "/(other)"
                                               : "(other)");
  if (backend == by_service_.end()) {
    const grpc::Status refused =
        NotServed("this gateway does not know the service of " + std::string(method));
    mark.End(FromGrpc(refused, {}), "");
    return RefuseCall(refused);
  }
  const BackendLink& link = *backend->second;
  // Methods of a newer version: the backend knows what they ask of their callers.
  const MethodRule unlisted{.method = method, .role = security::Role::kObserve};
  const Admission admission =
      shared_.guard().Admit(context, method, listed != nullptr ? listed : &unlisted);
  mark.SetCaller(admission.caller);
  if (admission.refusal) {
    mark.End(admission.refusal->error, admission.refusal->outcome);
    return RefuseCall(ToGrpc(admission.refusal->error));
  }
  if (calls_.fetch_add(1) >= kMostCalls) {
    --calls_;
    const Error full{ErrorCode::kResourceExhausted, "the gateway passes on " +
                                                        std::to_string(kMostCalls) +
                                                        " calls already, the most that it takes"};
    mark.End(full, "");
    return RefuseCall(ToGrpc(full));
  }
  std::map<std::string, std::string> metadata{{kRequestIdKey, mark.request_id()}};
  const bool in_his_name = link.speaks_for_others && !admission.caller.empty();
  if (in_his_name) {
    metadata[kForWhomKey] = admission.caller.substr(0, admission.caller.find(" via "));
  }
  return StartRelay(context, {.method = "/" + std::string(method),
                              .connection = link.connection,
                              .metadata = std::move(metadata),
                              // With his token it would be he who speaks for himself.
                              .pass_authorization = link.may_hear_secrets && !in_his_name,
                              .stop = shared_.shutdown().get_token(),
                              .translate =
                                  [this, &link](const grpc::Status& status) {
                                    if (status.error_code() == grpc::StatusCode::CANCELLED &&
                                        shared_.shutdown().stop_requested()) {
                                      return ToGrpc(Unavailable("the server is shutting down"));
                                    }
                                    // What gRPC itself says of a connection has no details; servers
                                    // of ours give some.
                                    if (status.error_code() != grpc::StatusCode::UNAVAILABLE ||
                                        !status.error_details().empty()) {
                                      return status;
                                    }
                                    return ToGrpc(Unavailable(link.place() + " does not answer: " +
                                                              PlainReason(status.error_message())));
                                  },
                              .on_done =
                                  [this, mark](const grpc::Status& status) {
                                    --calls_;
                                    if (status.ok()) {
                                      mark.End({}, "ok");
                                    } else {
                                      mark.End(FromGrpc(status, {}), "");
                                    }
                                  }});
}

}  // namespace exemplar::rpc
