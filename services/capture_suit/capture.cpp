#include "capture_suit/capture.hpp"

#include <utility>

#include "exemplar/ircp/metrics.hpp"

namespace exemplar::capture_suit {
namespace {

template <class Made>
Result<std::unique_ptr<Session>> AsSession(Result<std::unique_ptr<Made>> made) {
  if (!made) return made.error();
  return std::unique_ptr<Session>(std::move(*made));
}

}  // namespace

Status CheckUsage(const CaptureOptions& options) {
  if (options.person == !options.replay.empty()) {
    return InvalidArgument("give --replay FILE... or --person, one of them");
  }
  if (!options.person) return {};
  if (options.dead_man && !options.carrying.to.empty()) {
    return InvalidArgument("--carry-to goes without --dead-man: it is the simulator that follows");
  }
  if (options.robot_folder.empty()) return InvalidArgument("--person needs --robot", "robot");
  if (options.scene_file.empty()) return InvalidArgument("--person needs --scene", "scene");
  return {};
}

Result<std::unique_ptr<Session>> MakeSession(ircp::Bus& bus, const Clock& clock, Log& log,
                                             const CaptureOptions& options) {
  if (options.person) {
    const auto robot = kinematics::ReadRobotDescription(options.robot_folder);
    if (!robot) return robot.error();
    const auto scene = scene::ReadDescription(options.scene_file);
    if (!scene) return scene.error();
    if (!options.carrying.to.empty()) {
      CarrySessionOptions carrying = options.carrying;
      carrying.object = options.performing.object;
      carrying.places = options.performing.places;
      carrying.person = options.performing.person;
      carrying.person.seed = static_cast<std::uint64_t>(options.seed);
      carrying.record = options.record;
      carrying.name = options.name;
      carrying.demonstrator = options.demonstrator;
      return AsSession(CarrySession::Create(bus, clock, log, *robot, *scene, carrying));
    }
    PersonSessionOptions performing = options.performing;
    performing.record = options.record;
    performing.dead_man = options.dead_man;
    performing.name = options.name;
    performing.demonstrator = options.demonstrator;
    performing.person.seed = static_cast<std::uint64_t>(options.seed);
    return AsSession(PersonSession::Create(bus, clock, log, *robot, *scene, performing));
  }
  std::vector<demonstration::Trial> trials;
  for (const std::string& file : options.replay) {
    Result<demonstration::Trial> trial = ReadTrialFile(file);
    if (!trial) return trial.error();
    trials.push_back(std::move(*trial));
  }
  ReplayOptions replaying = options.replaying;
  replaying.record = options.record;
  replaying.dead_man = options.dead_man;
  replaying.name = options.name;
  replaying.demonstrator = options.demonstrator;
  return AsSession(ReplaySession::Create(bus, clock, log, std::move(trials), replaying));
}

std::vector<Metric> MetricsOf(const Session& session) {
  return {ircp::SentMetric("exemplar_capture_suit", [&session] { return session.sent(); }),
          Metric{"exemplar_capture_suit_readers", "Readers of each topic that trials are sent on",
                 false,
                 [&session] {
                   std::vector<Metric::Value> values;
                   for (const auto& [topic, count] : session.readers()) {
                     values.push_back({{{"topic", topic}}, static_cast<double>(count)});
                   }
                   return values;
                 }},
          CounterOf("exemplar_capture_suit_trials_total", "Trials sent to their end",
                    [&session] { return session.trials_ended(); })};
}

}  // namespace exemplar::capture_suit
