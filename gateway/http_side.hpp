#pragma once
#include <memory>
#include <vector>

#include "exemplar/api/json_calls.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/metric.hpp"
#include "exemplar/http/server.hpp"
#include "exemplar/rpc/server.hpp"
#include "gateway/door.hpp"
#include "gateway/program_options.hpp"

namespace exemplar::gateway {

/// The gateway's HTTP server: the calls of the gRPC server as JSON, health and figures.
class HttpSide {
 public:
  /// Listens, answers nothing before Start. `grpc` and `log` outlive it.
  static Result<std::unique_ptr<HttpSide>> Create(const ProgramOptions& words,
                                                  const program::CommonOptions& common,
                                                  rpc::Server& grpc, Log& log);
  /// For routes of others, before Start.
  http::Server& server() { return *server_; }
  api::JsonCalls& calls() { return *calls_; }
  /// `metrics` are what /metrics tells.
  Status Start(std::vector<Metric> metrics);
  void Stop() { server_->Stop(); }

 private:
  const SystemClock clock_{};
  std::string port_file_;
  rpc::Server* grpc_ = nullptr;
  std::unique_ptr<api::JsonCalls> calls_;
  std::unique_ptr<Door> door_;  ///< where an access file says who may call
  std::unique_ptr<http::Server> server_;
};

}  // namespace exemplar::gateway
