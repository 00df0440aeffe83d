#pragma once
#include <functional>
#include <memory>

#include "client_call.hpp"

namespace exemplar::rpc {

/// Follows a server's health by its health service, and asks again whenever it goes away. Its
/// destructor ends that.
class HealthWatch {
 public:
  /// `on_change` is called on threads of gRPC, one call at a time.
  HealthWatch(std::shared_ptr<Connection> connection, std::function<void(bool serving)> on_change);
  ~HealthWatch();
  HealthWatch(const HealthWatch&) = delete;
  HealthWatch& operator=(const HealthWatch&) = delete;

 private:
  struct State;
  class Call;
  static void Ask(const std::shared_ptr<State>& state);
  const std::shared_ptr<State> state_;  ///< shared with the call under way
};

}  // namespace exemplar::rpc
