// exemplar-reference-driver: a robot's driver without the robot; see docs/driver.md.

#include <mutex>

#include "exemplar/bus/participant.hpp"
#include "exemplar/ircp/control.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/program/network.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "reference_driver/driver.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "exemplar-reference-driver";
  std::string robot_folder;
  double rate_hz = 125;
  program::Options options(kName, "Stands for a robot whose joints move exactly as they are told",
                           "exemplar-reference-driver --robot deploy/models/arm7", {.bus = true});
  options.Add("--robot", robot_folder, "folder with robot.yaml and the URDF").Required();
  options.Add("--rate-hz", rate_hz, "of ircp/joint_state").MinMax(10, 1000);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;

  program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(options.common(), "driver");
  const SystemClock clock;
  const auto robot = kinematics::ReadRobotDescription(robot_folder);
  if (!robot.ok()) return program::Fail(kName, robot.error());
  auto participant =
      bus::Participant::Create(program::NetworkOf(options.common(), kName, log.get()));
  if (!participant.ok()) return program::Fail(kName, participant.error());

  std::mutex mutex;  // between the network's thread and the loop
  reference_driver::Driver driver(robot->chain.joint_names(), robot->chain.limits(), robot->home);
  const auto writer = (*participant)->MakeWriter<ircp::JointStateSample>("robot");
  if (!writer.ok()) return program::Fail(kName, writer.error());
  const auto reader = (*participant)
                          ->MakeReader<ircp::JointCommandSample>(
                              [&](const ircp::JointCommandSample& command, const auto&) {
                                const std::lock_guard lock(mutex);
                                (void)driver.Take(command, clock.Steady());  // counted
                              });
  if (!reader.ok()) return program::Fail(kName, reader.error());
  const auto control = ircp::ControlServer::Create(
      **participant, clock, "driver", [](const ircp::CommandSample& command) -> ircp::Answer {
        return {false, "\"" + command.action + "\" is no action: the driver has none", {}};
      });
  if (!control.ok()) return program::Fail(kName, control.error());
  (*control)->SetSentCounts([&]() -> std::vector<ircp::TopicCount> {
    return {{ircp::JointStateSample::kTopic, "robot", (*writer)->sent()}};
  });
  (*control)->SetValues([&]() -> std::map<std::string, std::string> {
    const std::lock_guard lock(mutex);
    return {{"following", driver.is_following() ? "yes" : "no"},
            {"commands_refused", std::to_string(driver.refused())},
            {"stale", std::to_string(driver.stale())}};
  });
  (*control)->SetState("running", "");
  log->Info("running", {{"joints", robot->chain.dof()}, {"rate_hz", rate_hz}});

  const Duration period = FromSeconds(1 / rate_hz);
  std::uint64_t stale = 0;
  for (Duration next = clock.Steady(); clock.SleepUntil(next, signals.token()); next += period) {
    ircp::JointStateSample state;
    {
      const std::lock_guard lock(mutex);
      driver.Step(clock.Steady());
      state = driver.State();
      if (driver.stale() != stale) log->Warning("commands stopped coming: the joints hold");
      stale = driver.stale();
    }
    if (const Status sent = (*writer)->Write(std::move(state)); !sent.ok()) {
      log->Warning("joint state not sent", {{"cause", sent.error().message}});
    }
  }
  log->Info("stopped");
  return 0;
}
