#include "gateway/http_side.hpp"

#include <memory>
#include <mutex>
#include <utility>

#include "exemplar/base/ids.hpp"
#include "exemplar/base/rng.hpp"
#include "exemplar/program/runtime.hpp"
#include "gateway/http_api.hpp"

namespace exemplar::gateway {
namespace {

std::function<std::string()> RequestIds() {
  struct Source {
    std::mutex mutex;
    Rng rng{EntropySeed()};
  };
  // Shared by the copies of the function.
  return [source = std::make_shared<Source>()] {
    const std::lock_guard lock(source->mutex);
    return MakeId("request", source->rng);
  };
}

}  // namespace

Result<std::unique_ptr<HttpSide>> HttpSide::Create(const ProgramOptions& words,
                                                   const program::CommonOptions& common,
                                                   rpc::Server& grpc, Log& log) {
  if (Status may = rpc::CheckListenAddress(words.http, common.server); !may) {
    return WithPlace(may.error(), "--http");
  }
  auto side = std::make_unique<HttpSide>();
  side->port_file_ = words.http_port_file;
  side->grpc_ = &grpc;
  side->calls_ = grpc.MakeJsonCalls();
  http::ServerOptions options = words.HttpOptions(common);
  if (!common.server.access.empty()) {
    auto door = Door::Open(common.server.access, side->clock_, log);
    if (!door) return door.error();
    side->door_ = std::move(*door);
    options.gate = [&door = *side->door_](http::Request& request) { return door.Judge(request); };
  }
  auto server = http::Server::Create(options, log);
  if (!server) return WithPlace(server.error(), "--http");
  side->server_ = std::move(*server);
  return side;
}

Status HttpSide::Start(std::vector<Metric> metrics) {
  HttpApi api;
  api.calls = calls_.get();
  api.health = [grpc = grpc_] {
    std::vector<HealthLine> lines;
    for (const rpc::BackendState& state : grpc->backends()) {
      lines.push_back({.name = state.name, .address = state.address, .serving = state.serving});
    }
    return lines;
  };
  api.metrics = [metrics = std::move(metrics)] { return program::MetricsText(metrics); };
  api.make_request_id = RequestIds();
  if (Status added = AddRoutes(*server_, api); !added) return added;
  if (door_ != nullptr) {
    if (Status added = door_->AddRoutes(*server_); !added) return added;
  }
  server_->Start();
  if (port_file_.empty()) return {};
  return rpc::WritePortFile(port_file_, server_->port());
}

}  // namespace exemplar::gateway
