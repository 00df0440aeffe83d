// exemplar-capture-vision: stereo pictures in, object poses out.

#include "capture_vision/metrics.hpp"
#include "capture_vision/session.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/bus/station_clock.hpp"
#include "exemplar/program/network.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "exemplar-capture-vision";
  std::string scene_file;
  program::Options options(kName, "Finds marked objects in the pictures on ircp/camera",
                           "exemplar-capture-vision --scene deploy/config/press_table.yaml",
                           {.bus = true, .clock = true});
  options.Add("--scene", scene_file, "file with the cameras and the objects' markers").Required();
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;

  program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(options.common(), "capture-vision");
  const auto scene = scene::ReadDescription(scene_file);
  if (!scene) return program::Fail(kName, scene.error());
  bus::ParticipantOptions network = program::NetworkOf(options.common(), kName, log.get());
  network.shared_memory_bytes = bus::kPictureSharedMemoryBytes;
  auto station_clock =
      bus::StationClock::Create(options.common().clock, network, "capture_vision", signals.token());
  if (!station_clock) return program::Fail(kName, station_clock.error());
  const Clock& clock = **station_clock;
  auto participant = bus::Participant::Create(network);
  if (!participant) return program::Fail(kName, participant.error());
  auto session = capture_vision::Session::Create(
      station_clock->bus(**participant), clock, *log, *scene,
      {.on_settled = [&station_clock] { station_clock->Recheck(); }});
  if (!session) return program::Fail(kName, session.error());
  const auto metrics =
      program::ServeMetrics(options.common(), capture_vision::MetricsOf(**session));
  if (!metrics) return program::Fail(kName, metrics.error());
  station_clock->SetSettled([&session] { return (*session)->is_settled(); });
  station_clock->Begin(ircp::NetworkClock::Caller::kOnlyWaits, *log, signals.token());
  (*session)->Run(signals.token());
  station_clock->SetSettled(nullptr);
  return 0;
}
