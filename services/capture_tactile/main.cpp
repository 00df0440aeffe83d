// exemplar-capture-tactile: what the hand feels, onto ircp/tactile.

#include "capture_tactile/metrics.hpp"
#include "capture_tactile/session.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/bus/station_clock.hpp"
#include "exemplar/program/network.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "exemplar-capture-tactile";
  bool from_robot = false;
  capture_tactile::SessionOptions session_options;
  program::Options options(kName, "Sends touch forces on ircp/tactile",
                           "exemplar-capture-tactile --from-robot --station lab",
                           {.bus = true, .clock = true});
  options.Add("--from-robot", from_robot, "the robot's own hand, from ircp/joint_state").Required();
  options.Add("--rate-hz", session_options.rate_hz, "how often the newest force is sent")
      .MinMax(1, 1000);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;

  const program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(options.common(), "capture-tactile");
  bus::ParticipantOptions network = program::NetworkOf(options.common(), kName, log.get());
  auto station_clock = bus::StationClock::Create(options.common().clock, network, "capture_tactile",
                                                 signals.token());
  if (!station_clock) return program::Fail(kName, station_clock.error());
  const Clock& clock = **station_clock;
  auto participant = bus::Participant::Create(network);
  if (!participant) return program::Fail(kName, participant.error());
  auto session = capture_tactile::Session::Create(station_clock->bus(**participant), clock, *log,
                                                  session_options);
  if (!session) return program::Fail(kName, session.error());
  const auto metrics =
      program::ServeMetrics(options.common(), capture_tactile::MetricsOf(**session));
  if (!metrics) return program::Fail(kName, metrics.error());
  station_clock->SetSettled([&session] { return (*session)->is_settled(); });
  station_clock->Begin(ircp::NetworkClock::Caller::kSleeps, *log, signals.token());
  (*session)->Run(signals.token());
  station_clock->SetSettled(nullptr);
  return 0;
}
