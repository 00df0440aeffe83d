// exemplar-recorder: a station's topics into MCAP files, told over gRPC and DDS.

#include "exemplar/bus/codec.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/bus/station_clock.hpp"
#include "exemplar/ircp/clock_watch.hpp"
#include "exemplar/program/network.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/rpc/call_log.hpp"
#include "exemplar/rpc/server.hpp"
#include "recorder/control_link.hpp"
#include "recorder/metrics.hpp"
#include "recorder/program_options.hpp"
#include "recorder/recorder.hpp"
#include "recorder/recordings.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "exemplar-recorder";
  program::Options options(kName, "Records a station's topics into MCAP files",
                           "exemplar-recorder --station lab --data-dir /var/lib/exemplar",
                           {.bus = true, .server = true, .data = true, .clock = true});
  recorder::ProgramOptions words;
  words.AddTo(options);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  const program::CommonOptions& common = options.common();

  program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(common, "recorder");
  bus::ParticipantOptions network = program::NetworkOf(common, kName, log.get());
  network.shared_memory_bytes = bus::kPictureSharedMemoryBytes;
  auto station_clock =
      bus::StationClock::Create(common.clock, network, "recorder", signals.token());
  if (!station_clock) return program::Fail(kName, station_clock.error());
  const Clock& clock = **station_clock;
  auto participant = bus::Participant::Create(network);
  if (!participant) return program::Fail(kName, participant.error());

  ircp::Bus& bus = station_clock->bus(**participant);
  // In simulated time there is but one clock.
  std::unique_ptr<ircp::ClockWatch> clocks;
  if (!station_clock->is_simulated()) {
    auto watch = ircp::ClockWatch::Create(bus, clock, *log, "recorder");
    if (!watch) return program::Fail(kName, watch.error());
    clocks = std::move(*watch);
  }
  const auto clock_jumps = [&clocks] { return clocks ? clocks->jumps() : 0; };
  std::unique_ptr<recorder::Recorder> recorder;
  // Ends before the recorder that it commands; shared, so that the recorder can see that it has.
  const auto control = std::make_shared<recorder::ControlLink>();
  recorder::RecorderOptions settings;
  settings.data_dir = common.data_dir;
  settings.station = common.station;
  if (const Status read = words.Apply(settings); !read) return program::Fail(kName, read.error());
  if (clocks) settings.clocks = [&clocks] { return clocks->relations(); };
  if (station_clock->is_simulated()) settings.unwanted = {ircp::ClockSample::kTopic};
  settings.on_change = [link = std::weak_ptr(control)](const std::string& state,
                                                       const std::string& detail) {
    if (const auto told = link.lock()) told->Tell(state, detail);
  };
  auto made = recorder::Recorder::Create(station_clock->raw_bus(**participant), clock, *log,
                                         bus::Decode<ircp::StatusSample>, std::move(settings));
  if (!made) return program::Fail(kName, made.error());
  recorder = std::move(*made);
  api::RecorderApi& api = *recorder;

  const Status linked = control->Open(bus, clock, *log, api, [&clock_jumps] {
    return std::map<std::string, std::string>{{"clock_jumps", std::to_string(clock_jumps())}};
  });
  if (!linked) return program::Fail(kName, linked.error());
  const auto recordings = recorder::Recordings::Create(
      api, clock, *log, {.data_dir = common.data_dir, .keep_days = words.keep_days()});
  if (!recordings) return program::Fail(kName, recordings.error());
  rpc::CallLog calls(*log);
  auto server = rpc::Server::Create(
      {.listen = common.listen,
       .port_file = common.port_file,
       .credentials = common.server,
       .log = log.get(),
       .on_call = [&calls](const rpc::CallRecord& call) { calls.Record(call); }},
      {.recorder = &api, .recorder_data = recordings->get()});
  if (!server) return program::Fail(kName, server.error());
  std::vector<Metric> figures = recorder::MetricsOf(api);
  for (Metric& metric : rpc::MetricsOf(calls, "exemplar_recorder")) {
    figures.push_back(std::move(metric));
  }
  figures.push_back(CounterOf("exemplar_recorder_clock_jumps_total",
                              "Clocks of the station's programs that jumped", clock_jumps));
  const auto metrics = program::ServeMetrics(common, std::move(figures));
  if (!metrics) return program::Fail(kName, metrics.error());
  log->Info("ready", {{"address", (*server)->address()}, {"data_dir", common.data_dir}});
  station_clock->Begin(ircp::NetworkClock::Caller::kOnlyWaits, *log, signals.token());
  signals.Wait();
  (*server)->Shutdown(std::chrono::seconds(1));
  recorder->Close();
  return 0;
}
