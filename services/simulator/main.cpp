// exemplar-simulator: a robot, a table and buttons in MuJoCo, on the network like the real ones.

#include "exemplar/bus/participant.hpp"
#include "exemplar/program/network.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "simulator/metrics.hpp"
#include "simulator/session.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "exemplar-simulator";
  std::string robot_folder;
  std::string scene_file;
  std::string follow = "command";
  std::string cameras = "on";
  simulator::SessionOptions settings;
  double step_ms = 1;

  program::Options options(
      kName, "Simulates a robot and what stands around it (MuJoCo); talks DDS as a real one would",
      "exemplar-simulator --robot deploy/models/leonardo --scene deploy/config/press_table.yaml",
      {.bus = true});
  options.Add("--robot", robot_folder, "folder with robot.yaml and the URDF").Required();
  options.Add("--scene", scene_file, "file that says what stands around the robot").Required();
  options.Add("--follow", follow, "whom the robot follows: ircp/joint_command or ircp/suit")
      .OneOf({"command", "suit"});
  options.Add("--cameras", cameras, "whether the scene's cameras send pictures")
      .OneOf({"on", "off"});
  options.Add("--rate-hz", settings.rate_hz, "of ircp/joint_state").MinMax(1, 1000);
  options
      .Add(
          "--track-hz", settings.track_hz,
          "of ircp/objects, as a tracking system measures buttons and objects; 0: cameras see them")
      .MinMax(0, 1000);
  options.Add("--step-ms", step_ms, "of the simulation").MinMax(0.1, 5);
  options.Add("--picture-encoding", settings.picture_encoding, "how pictures are sent")
      .OneOf({"jpeg", "png"});
  options.Add("--pace", settings.pace, "simulated seconds a second; 0: as many as can be")
      .MinMax(0, 1000);
  options.Add("--in-step-with", settings.in_step_with,
              "programs that run with --clock network: the simulated time waits for them; "
              "NAME@SECONDS: from that simulated time on");
  double stand_after_s = 0;
  options
      .Add("--stand-after-s", stand_after_s,
           "in step: time stands still once nobody has commanded the robot for so long, until "
           "somebody does; 0: it goes on")
      .MinMax(0, 1e6);
  double epoch_s = 0;
  options
      .Add("--epoch-s", epoch_s,
           "in step: what the wall clock says at the beginning, in seconds since 1970; 0: as the "
           "machine's")
      .MinMax(0, 4e9);
  double command_delay_ms = 0;
  options.Add("--command-delay-ms", command_delay_ms, "until the servos hear of a command")
      .MinMax(0, 1000);
  options.Add("--noise-position", settings.noise.position_rad, "of measured joints, rad or m")
      .MinMax(0, 1);
  options.Add("--noise-velocity", settings.noise.velocity_rad_s, "likewise, rad/s or m/s")
      .MinMax(0, 10);
  options.Add("--noise-touch", settings.noise.touch_n, "of the measured touch, N").MinMax(0, 100);
  options.Add("--noise-object", settings.noise.object_m, "of what --track-hz measures, m")
      .MinMax(0, 1);
  options.Add("--noise-object-turn", settings.noise.object_rad, "likewise, rad").MinMax(0, 1);
  int seed = 1;
  options.Add("--seed", seed, "of the sensors' noise").MinMax(0, 1e9);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;

  program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(options.common(), "simulator");
  ircp::LeaderClock clock;
  settings.leader_clock = &clock;
  settings.leader = follow == "suit" ? simulator::Leader::kSuit : simulator::Leader::kCommand;
  settings.cameras = cameras == "on";
  settings.world.step = FromSeconds(1e-3 * step_ms);
  if (epoch_s > 0) settings.epoch = Stamp() + FromSeconds(epoch_s);
  settings.stand_after = FromSeconds(stand_after_s);
  settings.command_delay = FromSeconds(1e-3 * command_delay_ms);
  settings.noise.seed = static_cast<std::uint64_t>(seed);

  const auto robot = kinematics::ReadRobotDescription(robot_folder);
  if (!robot) return program::Fail(kName, robot.error());
  const auto scene = scene::ReadDescription(scene_file);
  if (!scene) return program::Fail(kName, scene.error());
  bus::ParticipantOptions network = program::NetworkOf(options.common(), kName, log.get());
  network.clock = &clock;
  network.stamps_all = settings.pace != 1 || !settings.in_step_with.empty();
  auto participant = bus::Participant::Create(network);
  if (!participant) return program::Fail(kName, participant.error());
  std::unique_ptr<bus::Participant> pictures;
  if (settings.cameras && !scene->cameras.empty()) {
    network.name += " pictures";
    network.shared_memory_bytes = bus::kPictureSharedMemoryBytes;
    auto made = bus::Participant::Create(network);
    if (!made) return program::Fail(kName, made.error());
    pictures = std::move(*made);
    settings.picture_bus = pictures.get();
  }
  auto session = simulator::Session::Create(**participant, clock, *log, *robot, *scene, settings);
  if (!session) return program::Fail(kName, session.error());
  const auto metrics = program::ServeMetrics(options.common(), simulator::MetricsOf(**session));
  if (!metrics) return program::Fail(kName, metrics.error());
  (*session)->Run(signals.token());
  return 0;
}
