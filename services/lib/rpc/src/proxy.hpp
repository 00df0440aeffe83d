#pragma once
// Calls of other servers' services, passed on byte for byte: no message is read.

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_builder.h>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "client_call.hpp"
#include "exemplar/rpc/server.hpp"
#include "server_call.hpp"

namespace exemplar::rpc {

class HealthWatch;
class RelayedService;

/// One server behind, as its calls see it.
struct BackendLink {
  std::string name;
  std::shared_ptr<Connection> connection;  ///< shared with the calls under way
  bool may_hear_secrets = false;           ///< over TLS, or on this machine
  bool speaks_for_others = false;          ///< we have a certificate to show it

  /// "executor (127.0.0.1:40001)".
  std::string place() const { return name + " (" + connection->address() + ")"; }
};

/// Methods that the descriptors linked here know are registered by name, so that reflection and
/// metrics list them; all others of a backend's services, of a newer version than this one, are
/// passed on as well. Thread-safe.
class Proxy {
 public:
  static Result<std::unique_ptr<Proxy>> Create(ServerShared& shared,
                                               const std::vector<Backend>& backends);
  ~Proxy();
  Proxy(const Proxy&) = delete;
  Proxy& operator=(const Proxy&) = delete;

  void AddTo(grpc::ServerBuilder& builder);
  /// Follows the backends' health from now on and says it as that of their services.
  void Start(grpc::HealthCheckServiceInterface& health);
  /// Ends that; when it returns, `health` is not used any more.
  void Stop();
  /// Says it once more.
  void ReportHealth();
  std::vector<BackendState> states() const;

  // For its services.
  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Relay(
      grpc::CallbackServerContext& context, std::string_view method);

 private:
  explicit Proxy(ServerShared& shared);
  void SetServing(const BackendLink& backend, bool serving);

  /// Of all services; gets what nobody else takes.
  class Rest final : public grpc::CallbackGenericService {
   public:
    explicit Rest(Proxy& proxy) : proxy_(proxy) {}
    grpc::ServerGenericBidiReactor* CreateReactor(
        grpc::GenericCallbackServerContext* context) override;

   private:
    Proxy& proxy_;
  };

  ServerShared& shared_;
  std::vector<std::unique_ptr<BackendLink>> backends_;
  std::map<std::string, const BackendLink*, std::less<>> by_service_;
  std::vector<std::unique_ptr<RelayedService>> services_;
  Rest rest_{*this};
  std::atomic<int> calls_{0};  ///< under way

  mutable std::mutex mutex_;  ///< guards the two below
  grpc::HealthCheckServiceInterface* health_ = nullptr;
  std::map<const BackendLink*, bool> serving_;
  std::vector<std::unique_ptr<HealthWatch>> watches_;
};

}  // namespace exemplar::rpc
