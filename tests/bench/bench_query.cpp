// A query over gRPC beside a call that returns the same message precomputed, both served by one
// process and asked in turn by one client in another.
//
//   bench_query --serve --robot DIR --data-dir DIR --port-file F --peer-port-file G
//   bench_query --server HOST:PORT --peer HOST:PORT --skill NAME     measures both

#include <google/protobuf/util/message_differencer.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <shared_mutex>
#include <string>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/rpc/call_log.hpp"
#include "exemplar/rpc/server.hpp"
#include "exemplar/v1/skill.grpc.pb.h"
#include "learning/skills.hpp"
#include "learning/store.hpp"
#include "learning/trials.hpp"
#include "server_settings.hpp"

namespace exemplar {
namespace {

constexpr const char* kName = "bench_query";

struct Words {
  bool serve = false;
  std::string robot, data_dir, port_file, peer_port_file;
  std::string server, peer, skill;
  double x = 0, y = 0, z = 0;
  int calls = 4000;
};

class Client {
 public:
  explicit Client(const std::string& address)
      : stub_(v1::SkillService::NewStub(
            grpc::CreateChannel(address, grpc::InsecureChannelCredentials()))) {}

  grpc::Status Ask(const v1::QuerySkillRequest& request, v1::QuerySkillResponse* response) {
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    return stub_->Query(&context, request, response);
  }

 private:
  std::unique_ptr<v1::SkillService::Stub> stub_;
};

/// Returns what the learning service answered to the first request for a skill.
class Precomputed final : public v1::SkillService::Service {
 public:
  explicit Precomputed(const std::string& learning) : learning_(learning) {}

  grpc::Status Query(grpc::ServerContext*, const v1::QuerySkillRequest* request,
                     v1::QuerySkillResponse* response) override {
    const std::string& skill = request->skill().name();
    {
      const std::shared_lock lock(mutex_);
      if (const auto found = answers_.find(skill); found != answers_.end()) {
        *response = found->second;
        return grpc::Status::OK;
      }
    }
    const grpc::Status status = learning_.Ask(*request, response);
    const std::unique_lock lock(mutex_);
    if (status.ok()) answers_.emplace(skill, *response);
    return status;
  }

 private:
  Client learning_;
  std::shared_mutex mutex_;
  std::map<std::string, v1::QuerySkillResponse> answers_;
};

void WritePort(const std::string& file, int port) {
  std::ofstream(file + ".part") << port << "\n";
  std::rename((file + ".part").c_str(), file.c_str());
}

int Serve(const Words& words) {
  const program::Signals signals;
  const auto robot = kinematics::ReadRobotDescription(words.robot);
  if (!robot) return program::Fail(kName, robot.error());
  const auto store = learning_service::Store::Open(words.data_dir);
  if (!store) return program::Fail(kName, store.error());
  // As services/learning/main.cpp puts it together, without what reads recordings.
  const auto tool = std::make_shared<const kinematics::Chain>(robot->chain);
  const SystemClock clock;
  NullLog log;
  learning_service::Trials trials(
      **store, clock, tool, [](std::string_view, std::string_view) -> Result<demonstration::Trial> {
        return InvalidArgument("no recordings here");
      });
  learning_service::Skills skills(**store, trials, clock, tool, log);
  rpc::CallLog calls(log);
  const auto server =
      rpc::Server::Create({.on_call = [&](const rpc::CallRecord& call) { calls.Record(call); }},
                          {.trials = &trials, .skills = &skills});
  if (!server) return program::Fail(kName, server.error());

  Precomputed precomputed((*server)->address());
  grpc::ServerBuilder builder;
  rpc::ApplySettings(builder);
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&precomputed);
  const std::unique_ptr<grpc::Server> peer = builder.BuildAndStart();
  if (!peer) return program::Fail(kName, Unavailable("no port to listen on"));
  WritePort(words.peer_port_file, port);
  WritePort(words.port_file, (*server)->port());
  signals.Wait();
  peer->Shutdown();
  return 0;
}

double Quantile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

int Measure(const Words& words) {
  using SteadyClock = std::chrono::steady_clock;
  v1::QuerySkillRequest request;
  request.mutable_skill()->set_name(words.skill);
  v1::NamedPose* button = request.mutable_query()->add_objects();
  button->set_name("button");
  button->mutable_pose()->mutable_position()->set_x(words.x);
  button->mutable_pose()->mutable_position()->set_y(words.y);
  button->mutable_pose()->mutable_position()->set_z(words.z);

  Client real(words.server);
  Client peer(words.peer);
  std::vector<double> real_us, peer_us;
  v1::QuerySkillResponse of_real, of_peer;
  const int warm = words.calls / 10;
  for (int call = 0; call < warm + words.calls; ++call) {
    // Whoever is first in a turn finds the other's data in the caches.
    for (const bool ask_peer : {call % 2 == 0, call % 2 != 0}) {
      v1::QuerySkillResponse answer;
      const SteadyClock::time_point start = SteadyClock::now();
      const grpc::Status status = (ask_peer ? peer : real).Ask(request, &answer);
      const double us =
          std::chrono::duration<double, std::micro>(SteadyClock::now() - start).count();
      if (!status.ok()) return program::Fail(kName, Unavailable(status.error_message()));
      if (call == 0) (ask_peer ? of_peer : of_real) = answer;
      if (call >= warm) (ask_peer ? peer_us : real_us).push_back(us);
    }
  }
  // The version may have grown while it was learned anew.
  of_real.mutable_motion()->set_version(of_peer.motion().version());
  if (!google::protobuf::util::MessageDifferencer::Equals(of_real, of_peer)) {
    return program::Fail(kName, Internal("the two servers do not answer the same"));
  }
  nlohmann::json result = {{"bytes", of_real.ByteSizeLong()}, {"calls", words.calls}};
  for (const auto& [name, part] : {std::pair{"p50", 0.5}, std::pair{"p99", 0.99}}) {
    result[name] = {{"query_us", Quantile(real_us, part)}, {"peer_us", Quantile(peer_us, part)}};
  }
  std::printf("%s\n", result.dump().c_str());
  return 0;
}

}  // namespace
}  // namespace exemplar

int main(int argc, char** argv) {
  using namespace exemplar;
  Words words;
  program::Options options(kName, "Measures a query beside a precomputed answer",
                           "bench_query --server 127.0.0.1:50051 --peer 127.0.0.1:50052 "
                           "--skill press --x 0.4 --y -0.1 --z 0.05",
                           {});
  options.Add("--serve", words.serve, "serve both");
  options.Add("--robot", words.robot, "served: a folder of deploy/models");
  options.Add("--data-dir", words.data_dir, "served: where trials and skills are kept");
  options.Add("--port-file", words.port_file, "served: gets the learning service's port");
  options.Add("--peer-port-file", words.peer_port_file, "served: gets the peer's port");
  options.Add("--server", words.server, "the learning service");
  options.Add("--peer", words.peer, "the server that returns its answer precomputed");
  options.Add("--skill", words.skill, "name of the skill");
  options.Add("--x", words.x, "of the button (m)");
  options.Add("--y", words.y, "of the button (m)");
  options.Add("--z", words.z, "of the button (m)");
  options.Add("--calls", words.calls, "to each server").MinMax(100, 1e7);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  return words.serve ? Serve(words) : Measure(words);
}
