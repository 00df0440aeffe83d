// exemplar-executor: carries skills out on a robot, checked for collisions, over DDS.

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "executor/executor.hpp"
#include "executor/metrics.hpp"
#include "executor/realtime.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/bus/station_clock.hpp"
#include "exemplar/program/network.hpp"
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
  settings.rest_patience = std::chrono::seconds(10);  // simulated time may go on slowly
  settings.planner.guard.touch_n = 8;

  program::Options options(
      kName, "Executes skills on a robot: inverse kinematics, collision checks, joint commands",
      "exemplar-executor --robot deploy/models/arm7 --scene deploy/config/rail_press.yaml "
      "--learning 127.0.0.1:50051",
      {.bus = true, .server = true, .clock = true, .client = true});
  options.Add("--robot", robot_folder, "folder with robot.yaml and the URDF").Required();
  options.Add("--scene", scene_file, "file that says what stands around the robot").Required();
  options.Add("--learning", learning, "HOST:PORT of the learning service").Required();
  options.Add("--rate-hz", settings.rate_hz, "of ircp/joint_command").MinMax(1, 1000);
  options
      .Add("--clearance-m", settings.planner.plan.required_clearance_m,
           "room that planned motions keep to everything but what they touch")
      .MinMax(0, 0.5);
  options.Add("--touch-limit-n", settings.watch.touch_n, "force of a touch that stops a motion")
      .MinMax(0.1, 10000);
  std::vector<std::string> path_tolerance;
  options.Add(
      "--path-tolerance", path_tolerance,
      "how far a joint may be from where it is commanded, in rad or m, and JOINT=NUMBER for "
      "one joint (default 0.35)");
  std::vector<std::string> goal_tolerance;
  options.Add("--goal-tolerance", goal_tolerance,
              "likewise from the motion's last point once it is reached (default 0.1)");
  options
      .Add("--measured-clearance-m", settings.watch.clearance_m,
           "a motion is stopped where the measured robot comes nearer to anything that it may not "
           "touch")
      .MinMax(0, 0.5);
  double state_patience_s = 0.25;
  options.Add("--state-patience-s", state_patience_s, "how old ircp/joint_state may be")
      .MinMax(0.01, 10);
  double command_patience_s = 0.25;
  options
      .Add("--command-patience-s", command_patience_s,
           "how old the command may be that the robot says it acts on")
      .MinMax(0.01, 10);
  double safety_patience_s = 0;
  options
      .Add("--safety-patience-s", safety_patience_s,
           "nothing moves without a sample on ircp/safety that is younger; 0: not asked for")
      .MinMax(0, 10);
  options
      .Add("--guard-touch-n", settings.planner.guard.touch_n,
           "where the robot feels touch: a press goes on slowly past the expected contact until a "
           "touch of this force, or twice what the button needs, ends it; 0: by position alone")
      .MinMax(0, 1000);
  options
      .Add("--guard-distance-m", settings.planner.guard.distance_m,
           "how far past the expected contact a press looks for touch")
      .MinMax(0.0005, 0.05);
  options.Add("--guard-speed-m-s", settings.planner.guard.speed_m_s, "of the tool meanwhile")
      .MinMax(0.001, 0.2);
  std::string way = "exemplar";
  options.Add("--inverse-kinematics", way, "how joints are made to follow a tool path")
      .OneOf({"exemplar", "plain", "energy", "path"});
  std::string joint_map;
  options.Add(
      "--joint-map", joint_map,
      "file that says which joint of a suit drives which of the robot; the robot's folder's "
      "suit.yaml when not given");
  executor::TeleoperationOptions& teleoperation = settings.teleoperation;
  options
      .Add("--teleop-clearance-m", teleoperation.clearance_m,
           "room that a teleoperated robot keeps to everything but what it may touch")
      .MinMax(0.001, 0.5);
  options
      .Add("--approach-range", teleoperation.approach_range_rad,
           "how far a joint may be from the operator's when teleoperation begins, in rad or m")
      .MinMax(0.01, 10);
  options
      .Add("--approach-speed", teleoperation.approach_share,
           "on the way there, share of the joints' speed limits")
      .MinMax(0.01, 1);
  double suit_patience_s = 0.15;
  options.Add("--suit-patience-s", suit_patience_s, "how old ircp/suit may be").MinMax(0.03, 2);
  double dead_man_patience_s = 0.25;
  options
      .Add("--dead-man-patience-s", dead_man_patience_s,
           "how old the dead-man on ircp/safety may be")
      .MinMax(0.06, 2);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  teleoperation.suit_patience = FromSeconds(suit_patience_s);
  teleoperation.suit.lateness = teleoperation.suit_patience;
  teleoperation.dead_man_patience = FromSeconds(dead_man_patience_s);
  settings.planner.state_patience = FromSeconds(state_patience_s);
  settings.watch.stream.delay_patience = settings.planner.state_patience;
  settings.watch.stream.frozen_patience =
      std::max(settings.watch.stream.frozen_patience, settings.planner.state_patience);
  settings.watch.stream.command_patience = FromSeconds(command_patience_s);
  settings.safety_patience = FromSeconds(safety_patience_s);
  settings.planner.plan.inverse_kinematics = *motion::ParsePathIkVariant(way);

  program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(options.common(), "executor");
  if (!executor::LockMemory()) {
    log->Info("memory is not locked", {{"advice", "raise the memlock limit to unlimited"}});
  }
  const auto robot = kinematics::ReadRobotDescription(robot_folder);
  if (!robot.ok()) return program::Fail(kName, robot.error());
  for (const auto& [words, tolerance] : {std::pair{&path_tolerance, &settings.watch.path},
                                         std::pair{&goal_tolerance, &settings.watch.goal}}) {
    const auto read =
        executor::ParseTolerance(*words, robot->chain.joint_names(), tolerance->general);
    if (!read.ok()) return options.Refuse(read.error().message);
    *tolerance = *read;
  }
  const std::filesystem::path own_map = std::filesystem::path(robot_folder) / "suit.yaml";
  if (joint_map.empty() && std::filesystem::exists(own_map)) joint_map = own_map.string();
  if (!joint_map.empty()) {
    auto map = executor::JointMap::Read(joint_map, robot->chain.joint_names());
    if (!map.ok()) return program::Fail(kName, map.error());
    settings.joint_map = *std::move(map);
  }
  const auto scene = scene::ReadDescription(scene_file);
  if (!scene.ok()) return program::Fail(kName, scene.error());
  const auto clients = rpc::Connect(
      {.server = learning, .request_id = "executor", .credentials = options.common().client});
  if (!clients.ok()) return program::Fail(kName, clients.error());
  bus::ParticipantOptions network = program::NetworkOf(options.common(), kName, log.get());
  auto station_clock =
      bus::StationClock::Create(options.common().clock, network, "executor", signals.token());
  if (!station_clock.ok()) return program::Fail(kName, station_clock.error());
  const Clock& clock = **station_clock;
  auto participant = bus::Participant::Create(network);
  if (!participant.ok()) return program::Fail(kName, participant.error());
  settings.on_taken = [&station_clock] { station_clock->Recheck(); };
  auto app = executor::Executor::Create(station_clock->bus(**participant), clock, *log,
                                        *clients->skills, *robot, *scene, settings);
  if (!app.ok()) return program::Fail(kName, app.error());
  rpc::CallLog calls(*log);
  auto server = rpc::Server::Create(
      {.listen = options.common().listen,
       .port_file = options.common().port_file,
       .credentials = options.common().server,
       .log = log.get(),
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

  station_clock->SetSettled([&app] { return (*app)->IsSettled(); });
  station_clock->Begin(ircp::NetworkClock::Caller::kOnlyWaits, *log, signals.token());
  signals.Wait();
  (*app)->Shutdown();
  (*server)->Shutdown(std::chrono::seconds(1));
  station_clock->SetSettled(nullptr);
  log->Info("stopped");
  return 0;
}
