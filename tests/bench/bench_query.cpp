// A query over gRPC beside a call that returns the same message precomputed: one process each,
// asked in turn by one client.
//
//   bench_query --copy-of HOST:PORT --skill NAME --port-file F    serves what that server answered
//   bench_query --server HOST:PORT --peer HOST:PORT --skill NAME  measures both

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
#include <string>
#include <vector>

#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/v1/skill.grpc.pb.h"

namespace exemplar {
namespace {

constexpr const char* kName = "bench_query";

struct Words {
  std::string server, peer, copy_of, skill, port_file;
  std::vector<double> at;
  std::vector<std::string> object;
  int calls = 4000;
};

class Client {
 public:
  explicit Client(const std::string& address)
      : stub_(v1::SkillService::NewStub(
            grpc::CreateChannel(address, grpc::InsecureChannelCredentials()))) {}

  Result<v1::QuerySkillResponse> Ask(const v1::QuerySkillRequest& request) {
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    v1::QuerySkillResponse response;
    const grpc::Status status = stub_->Query(&context, request, &response);
    if (!status.ok()) return Unavailable(status.error_message());
    return response;
  }

 private:
  std::unique_ptr<v1::SkillService::Stub> stub_;
};

class Precomputed final : public v1::SkillService::Service {
 public:
  explicit Precomputed(v1::QuerySkillResponse answer) : answer_(std::move(answer)) {}
  grpc::Status Query(grpc::ServerContext*, const v1::QuerySkillRequest*,
                     v1::QuerySkillResponse* response) override {
    *response = answer_;
    return grpc::Status::OK;
  }

 private:
  const v1::QuerySkillResponse answer_;
};

int Serve(const Words& words, const v1::QuerySkillRequest& request) {
  const program::Signals signals;
  Result<v1::QuerySkillResponse> answer = Client(words.copy_of).Ask(request);
  if (!answer) return program::Fail(kName, answer.error());
  Precomputed service(*std::move(answer));
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  if (!server) return program::Fail(kName, Unavailable("no port to listen on"));
  std::ofstream(words.port_file + ".part") << port << "\n";
  std::rename((words.port_file + ".part").c_str(), words.port_file.c_str());
  signals.Wait();
  server->Shutdown();
  return 0;
}

double Quantile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

int Measure(const Words& words, const v1::QuerySkillRequest& request) {
  using SteadyClock = std::chrono::steady_clock;
  Client real(words.server);
  Client peer(words.peer);
  std::vector<double> real_us, peer_us;
  std::size_t bytes = 0;
  const int warm = words.calls / 10;
  for (int call = 0; call < warm + words.calls; ++call) {
    // Whoever is first in a turn finds the other's data in the caches.
    for (const bool ask_peer : {call % 2 == 0, call % 2 != 0}) {
      const SteadyClock::time_point start = SteadyClock::now();
      const Result<v1::QuerySkillResponse> answer = (ask_peer ? peer : real).Ask(request);
      const double us =
          std::chrono::duration<double, std::micro>(SteadyClock::now() - start).count();
      if (!answer) return program::Fail(kName, answer.error());
      if (call == 0) bytes = std::max(bytes, answer->ByteSizeLong());
      if (call >= warm) (ask_peer ? peer_us : real_us).push_back(us);
    }
  }
  const Result<v1::QuerySkillResponse> a = real.Ask(request);
  const Result<v1::QuerySkillResponse> b = peer.Ask(request);
  if (!a || !b || !google::protobuf::util::MessageDifferencer::Equals(*a, *b)) {
    return program::Fail(kName, Internal("the two servers do not answer the same"));
  }
  nlohmann::json result = {{"bytes", bytes}, {"calls", words.calls}};
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
  std::vector<std::string> at;
  double x = 0, y = 0, z = 0;
  program::Options options(kName, "Measures a query beside a precomputed answer",
                           "bench_query --server 127.0.0.1:50051 --peer 127.0.0.1:50052 "
                           "--skill press --x 0.4 --y -0.1 --z 0.05",
                           {});
  options.Add("--server", words.server, "the learning service");
  options.Add("--peer", words.peer, "the server that returns its answer precomputed");
  options.Add("--copy-of", words.copy_of, "serve, precomputed, what this server answers");
  options.Add("--port-file", words.port_file, "gets the port of --copy-of");
  options.Add("--skill", words.skill, "name of the skill").Required();
  options.Add("--x", x, "of the button (m)");
  options.Add("--y", y, "of the button (m)");
  options.Add("--z", z, "of the button (m)");
  options.Add("--calls", words.calls, "to each server").MinMax(100, 1e7);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  v1::QuerySkillRequest request;
  request.mutable_skill()->set_name(words.skill);
  v1::NamedPose* button = request.mutable_query()->add_objects();
  button->set_name("button");
  button->mutable_pose()->mutable_position()->set_x(x);
  button->mutable_pose()->mutable_position()->set_y(y);
  button->mutable_pose()->mutable_position()->set_z(z);
  return words.copy_of.empty() ? Measure(words, request) : Serve(words, request);
}
