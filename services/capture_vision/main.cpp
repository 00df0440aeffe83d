// exemplar-capture-vision: stereo pictures in, object poses out.

#include "capture_vision/metrics.hpp"
#include "capture_vision/session.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "exemplar-capture-vision";
  std::string scene_file;
  program::Options options(kName, "Finds marked objects in the pictures on ircp/camera",
                           "exemplar-capture-vision --scene deploy/config/press_table.yaml",
                           {.bus = true});
  options.Add("--scene", scene_file, "file with the cameras and the objects' markers").Required();
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;

  program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(options.common(), "capture-vision");
  const SystemClock clock;
  const auto scene = scene::ReadDescription(scene_file);
  if (!scene) return program::Fail(kName, scene.error());
  auto participant =
      bus::Participant::Create({.domain = options.common().domain,
                                .station = options.common().station,
                                .name = kName,
                                .interfaces = options.common().interfaces,
                                .peers = options.common().peers,
                                .discovery_servers = options.common().discovery_servers,
                                .best_effort_topics = options.common().best_effort,
                                .shared_memory_bytes = bus::kPictureSharedMemoryBytes,
                                .security = options.common().security,
                                .clock = &clock,
                                .log = log.get()});
  if (!participant) return program::Fail(kName, participant.error());
  auto session = capture_vision::Session::Create(**participant, clock, *log, *scene);
  if (!session) return program::Fail(kName, session.error());
  const auto metrics =
      program::ServeMetrics(options.common(), capture_vision::MetricsOf(**session));
  if (!metrics) return program::Fail(kName, metrics.error());
  (*session)->Run(signals.token());
  return 0;
}
