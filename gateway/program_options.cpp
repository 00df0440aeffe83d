#include "gateway/program_options.hpp"

#include <utility>

namespace exemplar::gateway {
namespace {

/// Streams that are read (topics, progress) hold one each.
constexpr std::size_t kHttpHandlers = 128;

}  // namespace

void ProgramOptions::AddTo(program::Options& options) {
  options.Add("--learning", learning, "HOST:PORT of the learning service (skills and trials)");
  options.Add("--trials", trials, "HOST:PORT of the trials, where it is not the learning service");
  options.Add("--executor", executor, "HOST:PORT of the executor");
  options.Add("--recorder", recorder, "HOST:PORT of the recorder");
  options.Add("--http", http, "HOST:PORT of HTTP and WebSocket; port 0 picks one; empty: none");
  options.Add("--http-port-file", http_port_file, "file that gets that port");
  options.Add("--origin", origins,
              "web pages of other origins that may use HTTP (https://app.foxglove.dev), * for all");
  options.Add("--robot", robot,
              "folder of the robot's description, for the web page, Foxglove and ROS 2");
  options.Add("--scene", scene, "file of the place of work, for the web page");
  options.Add("--web", web,
              "folder of the web page; default: where the build or the installation puts it");
  options.Add("--ros2", ros2,
              "be a neighbour of the ROS 2 nodes of the domain: joint states, transforms, objects, "
              "plans (docs/ros2.md)");
  options.Add("--ros2-rate-hz", ros2_rate_hz, "largest rate of joint states and transforms there")
      .MinMax(1, 1000);
  options.Add("--ros2-robot-from", ros2_robot_from,
              "ROS 2 topic of sensor_msgs/JointState that is the station's robot");
  options.Add("--recordings", recordings, "folder whose recordings Foxglove clients may play");
  options.Add("--publish", publish,
              "topics that clients may publish on, * for any text; default: none");
  options.Add("--queue", queue, "samples that wait for a slow client before its oldest are dropped")
      .MinMax(1, 1e6);
}

http::ServerOptions ProgramOptions::HttpOptions(const program::CommonOptions& common) const {
  http::ServerOptions server;
  server.listen = http;
  server.origins.allowed = origins;
  server.limits.handlers = kHttpHandlers;
  if (!common.server.certificate.empty()) {
    server.tls = http::TlsFiles{.certificate = common.server.certificate,
                                .key = common.server.key,
                                .client_ca = common.server.client_ca,
                                .require_client = !common.server.client_ca.empty()};
  }
  return server;
}

std::vector<rpc::Backend> ProgramOptions::Backends(const program::CommonOptions& common) const {
  std::vector<rpc::Backend> backends;
  const auto add = [&](const char* name, const std::string& address,
                       std::vector<std::string> services) {
    if (address.empty()) return;
    rpc::Backend& backend = backends.emplace_back();
    backend.name = name;
    backend.connection.server = address;
    backend.connection.credentials = common.client;
    backend.services = std::move(services);
  };
  const bool together = trials.empty() || trials == learning;
  add("learning", learning,
      together ? std::vector<std::string>{"exemplar.v1.SkillService", "exemplar.v1.TrialService",
                                          "exemplar.v1.LearningDataService"}
               : std::vector<std::string>{"exemplar.v1.SkillService"});
  if (!together) {
    add("trials", trials, {"exemplar.v1.TrialService", "exemplar.v1.LearningDataService"});
  }
  add("executor", executor, {"exemplar.v1.ExecutorService"});
  add("recorder", recorder, {"exemplar.v1.RecorderService", "exemplar.v1.RecorderDataService"});
  return backends;
}

}  // namespace exemplar::gateway
