// exemplar-capture-suit: the demonstrator's joints onto the network: a trial from files, or a
// simulated person.

#include "capture_suit/person_session.hpp"
#include "capture_suit/replay_session.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"

namespace {

using namespace exemplar;

constexpr int kUsageExitCode = 2;

struct Arguments {
  std::vector<std::string> replay;
  capture_suit::ReplayOptions replay_options;
  bool person = false;
  std::string robot_folder;
  std::string scene_file;
  capture_suit::PersonSessionOptions person_options;
  std::string name = "trial";
  int seed = 1;
  bool record = false;
};

Status Replay(ircp::Bus& bus, const Clock& clock, Log& log, const Arguments& arguments,
              std::stop_token stop) {
  std::vector<demonstration::Trial> trials;
  for (const std::string& file : arguments.replay) {
    Result<demonstration::Trial> trial = capture_suit::ReadTrialFile(file);
    if (!trial) return trial.error();
    trials.push_back(std::move(*trial));
  }
  auto session = capture_suit::ReplaySession::Create(bus, clock, log, std::move(trials),
                                                     arguments.replay_options);
  return session ? (*session)->Run(stop) : Status(session.error());
}

Status Perform(ircp::Bus& bus, const Clock& clock, Log& log, const Arguments& arguments,
               std::stop_token stop) {
  const auto robot = kinematics::ReadRobotDescription(arguments.robot_folder);
  if (!robot) return robot.error();
  const auto scene = scene::ReadDescription(arguments.scene_file);
  if (!scene) return scene.error();
  auto session = capture_suit::PersonSession::Create(bus, clock, log, *robot, *scene,
                                                     arguments.person_options);
  return session ? (*session)->Run(stop) : Status(session.error());
}

}  // namespace

int main(int argc, char** argv) {
  constexpr const char* kName = "exemplar-capture-suit";
  Arguments arguments;
  capture_suit::PersonSessionOptions& person = arguments.person_options;
  program::Options options(
      kName, "Sends a demonstrator's joints: trials from files, or a simulated person",
      "exemplar-capture-suit --replay trial01.csv trial02.csv --rate 4 --record\n"
      "exemplar-capture-suit --person --robot deploy/models/leonardo \\\n"
      "  --scene deploy/config/press_table.yaml --places '0.46,-0.12;0.4,-0.28' --record",
      {.bus = true});
  options.Add("--replay", arguments.replay, "trial files (CSV) to play");
  options.Add("--rate", arguments.replay_options.rate, "so many times faster than recorded")
      .MinMax(1e-3, 1e3);
  options.Add("--frame", arguments.replay_options.frame, "frame of the files' poses");
  options.Add("--person", arguments.person, "simulate a person who presses a button");
  options.Add("--robot", arguments.robot_folder, "folder with robot.yaml: the person's body");
  options.Add("--scene", arguments.scene_file, "file that says what stands around the body");
  options.Add("--places", person.places, "x,y[,z[,qx,qy,qz,qw]];... of the button, base frame, m");
  options.Add("--object", person.object, "the button to press; the scene's first when not given");
  options.Add("--place-only", person.place_only, "put the button there and press nothing");
  options
      .Add("--press-depth", person.press_depth_m,
           "below the button's face, m; 0: its travel and 3 mm more")
      .MinMax(0, 0.05);
  options.Add("--tempo", person.person.tempo, "of the person; 2: twice as fast").MinMax(0.2, 5);
  options.Add("--seed", arguments.seed, "of the person's chance").MinMax(0, 2e9);
  options.Add("--record", arguments.record, "have the recorder record every trial");
  options.Add("--name", arguments.name, "of the recordings; several are numbered NAME-001");
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  if (arguments.person == !arguments.replay.empty()) {
    program::Fail(kName, InvalidArgument("give --replay FILE... or --person, one of them"));
    return kUsageExitCode;
  }
  arguments.replay_options.record = person.record = arguments.record;
  arguments.replay_options.name = person.name = arguments.name;
  person.person.seed = static_cast<std::uint64_t>(arguments.seed);

  program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(options.common(), "capture-suit");
  const SystemClock clock;
  auto participant = bus::Participant::Create({.domain = options.common().domain,
                                               .station = options.common().station,
                                               .name = kName,
                                               .clock = &clock,
                                               .log = log.get()});
  if (!participant) return program::Fail(kName, participant.error());
  const Status done = arguments.person
                          ? Perform(**participant, clock, *log, arguments, signals.token())
                          : Replay(**participant, clock, *log, arguments, signals.token());
  if (done || done.error().code == ErrorCode::kCancelled) return 0;
  return program::Fail(kName, done.error());
}
