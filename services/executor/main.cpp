// exemplar-executor: carries skills out on a robot, checked for collisions, over DDS.

#include "executor/executor.hpp"
#include "executor/metrics.hpp"
#include "executor/realtime.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/rpc/call_log.hpp"
#include "exemplar/rpc/client.hpp"
#include "exemplar/rpc/server.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "exemplar-executor";
  std::string robot_folder;
  std::string scene_file;
  std::string learning;
  executor::ExecutorOptions settings;
  settings.realtime = true;

  program::Options options(
      kName, "Executes skills on a robot: inverse kinematics, collision checks, joint commands",
      "exemplar-executor --robot deploy/models/arm7 --scene deploy/config/rail_press.yaml "
      "--learning 127.0.0.1:50051",
      {.bus = true, .server = true});
  options.Add("--robot", robot_folder, "folder with robot.yaml and the URDF").Required();
  options.Add("--scene", scene_file, "file that says what stands around the robot").Required();
  options.Add("--learning", learning, "HOST:PORT of the learning service").Required();
  options.Add("--rate-hz", settings.rate_hz, "of ircp/joint_command").MinMax(1, 1000);
  options
      .Add("--clearance-m", settings.plan.required_clearance_m,
           "room that planned motions keep to everything but what they touch")
      .MinMax(0, 0.5);
  options.Add("--touch-limit-n", settings.watch.touch_n, "force of a touch that stops a motion")
      .MinMax(0.1, 10000);
  std::string way = "exemplar";
  options.Add("--inverse-kinematics", way, "how joints are made to follow a tool path")
      .OneOf({"exemplar", "plain", "energy", "path"});
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  settings.plan.inverse_kinematics = *motion::ParsePathIkVariant(way);

  program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(options.common(), "executor");
  if (!executor::LockMemory()) {
    log->Info("memory is not locked", {{"advice", "raise the memlock limit to unlimited"}});
  }
  const SystemClock clock;
  const auto robot = kinematics::ReadRobotDescription(robot_folder);
  if (!robot.ok()) return program::Fail(kName, robot.error());
  const auto scene = scene::ReadDescription(scene_file);
  if (!scene.ok()) return program::Fail(kName, scene.error());
  const auto clients = rpc::Connect({.server = learning, .request_id = "executor"});
  if (!clients.ok()) return program::Fail(kName, clients.error());
  auto participant =
      bus::Participant::Create({.domain = options.common().domain,
                                .station = options.common().station,
                                .name = kName,
                                .interfaces = options.common().interfaces,
                                .peers = options.common().peers,
                                .discovery_servers = options.common().discovery_servers,
                                .best_effort_topics = options.common().best_effort,
                                .clock = &clock,
                                .log = log.get()});
  if (!participant.ok()) return program::Fail(kName, participant.error());
  auto app = executor::Executor::Create(**participant, clock, *log, *clients->skills, *robot,
                                        *scene, settings);
  if (!app.ok()) return program::Fail(kName, app.error());
  rpc::CallLog calls(*log);
  auto server = rpc::Server::Create(
      {.listen = options.common().listen,
       .port_file = options.common().port_file,
       .on_call = [&calls](const rpc::CallRecord& call) { calls.Record(call); }},
      {.executor = app->get()});
  if (!server.ok()) return program::Fail(kName, server.error());
  std::vector<Metric> figures = executor::MetricsOf(**app);
  for (Metric& metric : rpc::MetricsOf(calls, "exemplar_executor")) {
    figures.push_back(std::move(metric));
  }
  const auto metrics = program::ServeMetrics(options.common(), std::move(figures));
  if (!metrics.ok()) return program::Fail(kName, metrics.error());
  log->Info("serving", {{"address", (*server)->address()}, {"robot", robot->name}});

  signals.Wait();
  (*app)->Shutdown();
  (*server)->Shutdown(std::chrono::seconds(1));
  log->Info("stopped");
  return 0;
}
