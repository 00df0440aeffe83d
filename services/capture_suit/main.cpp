// exemplar-capture-suit: the demonstrator's joints onto the network: a trial from files, or a
// simulated person.

#include "capture_suit/capture.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/bus/station_clock.hpp"
#include "exemplar/program/network.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "exemplar-capture-suit";
  constexpr int kInterrupted = 130;
  capture_suit::CaptureOptions what;
  capture_suit::PersonSessionOptions& person = what.performing;
  program::Options options(
      kName, "Sends a demonstrator's joints: trials from files, or a simulated person",
      "exemplar-capture-suit --replay trial01.csv trial02.csv --rate 4 --record\n"
      "exemplar-capture-suit --person --robot deploy/models/leonardo \\\n"
      "  --scene deploy/config/press_table.yaml --places '0.46,-0.12;0.4,-0.28' --record\n"
      "Ends by itself; 130 says that it was interrupted before its last trial.",
      {.bus = true, .clock = true});
  options.Add("--replay", what.replay, "trial files (CSV) to play");
  options.Add("--rate", what.replaying.rate, "so many times faster than recorded")
      .MinMax(1e-3, 1e3);
  options.Add("--frame", what.replaying.frame, "frame of the files' poses");
  options.Add("--person", what.person, "simulate a person who presses a button");
  options.Add("--robot", what.robot_folder, "folder with robot.yaml: the person's body");
  options.Add("--scene", what.scene_file, "file that says what stands around the body");
  options.Add("--places", person.places,
              "x,y[,z[,qx,qy,qz,qw]];... of the button, base frame, m; where the scene has it when "
              "not given");
  options.Add("--object", person.object, "the button to press; the scene's first when not given");
  options.Add("--carry-to", what.carrying.to,
              "take --object with the hand and lay it down on this object, instead of pressing");
  options.Add("--to-places", what.carrying.to_places,
              "of that object, as --places; as many, or one");
  options.Add("--place-only", person.place_only, "put the button there and press nothing");
  options
      .Add("--press-depth", person.press_depth_m,
           "below the button's face, m; 0: its travel and 3 mm more")
      .MinMax(0, 0.05);
  options.Add("--tempo", person.person.tempo, "of the person; 2: twice as fast").MinMax(0.2, 5);
  options.Add("--seed", what.seed, "of the person's chance").MinMax(0, 2e9);
  options.Add("--dead-man", what.dead_man,
              "hold the dead-man on ircp/safety while a trial goes on, for a robot that is "
              "teleoperated; a trial begins once the robot follows");
  options.Add("--record", what.record, "have the recorder record every trial");
  options.Add("--name", what.name, "of the recordings; several are numbered NAME-001");
  options.Add("--demonstrator", what.demonstrator,
              "whose demonstrations: a pseudonymous id, kept in the recordings");
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  if (const Status usage = capture_suit::CheckUsage(what); !usage) {
    return options.Refuse(usage.error().message);
  }

  program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(options.common(), "capture-suit");
  bus::ParticipantOptions network = program::NetworkOf(options.common(), kName, log.get());
  auto station_clock =
      bus::StationClock::Create(options.common().clock, network, "capture_suit", signals.token());
  if (!station_clock) return program::Fail(kName, station_clock.error());
  const Clock& clock = **station_clock;
  auto participant = bus::Participant::Create(network);
  if (!participant) return program::Fail(kName, participant.error());
  const auto session =
      capture_suit::MakeSession(station_clock->bus(**participant), clock, *log, what);
  if (!session) return program::Fail(kName, session.error());
  const auto metrics = program::ServeMetrics(options.common(), capture_suit::MetricsOf(**session));
  if (!metrics) return program::Fail(kName, metrics.error());
  station_clock->Begin(ircp::NetworkClock::Caller::kSleeps, *log, signals.token());
  const Status done = (*session)->Run(signals.token());
  if (done) return 0;
  const int code = program::Fail(kName, done.error());
  return done.error().code == ErrorCode::kCancelled ? kInterrupted : code;
}
