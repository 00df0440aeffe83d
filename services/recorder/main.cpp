// exemplar-recorder: a station's topics into MCAP files, told over gRPC and DDS.

#include <atomic>

#include "exemplar/bus/codec.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/ircp/control.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/rpc/call_log.hpp"
#include "exemplar/rpc/server.hpp"
#include "recorder/control_commands.hpp"
#include "recorder/metrics.hpp"
#include "recorder/program_options.hpp"
#include "recorder/recorder.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "exemplar-recorder";
  bool all_topics = false;
  program::Options options(kName, "Records a station's topics into MCAP files",
                           "exemplar-recorder --station lab --data-dir /var/lib/exemplar",
                           {.bus = true, .server = true, .data = true});
  options.Add("--all-topics", all_topics, "record every topic, not only those under ircp/");
  recorder::ProgramOptions words;
  words.AddTo(options);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  const program::CommonOptions& common = options.common();

  program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(common, "recorder");
  const SystemClock clock;
  auto participant = bus::Participant::Create({.domain = common.domain,
                                               .station = common.station,
                                               .name = kName,
                                               .clock = &clock,
                                               .log = log.get()});
  if (!participant) return program::Fail(kName, participant.error());

  std::unique_ptr<ircp::ControlServer> control;
  std::atomic<ircp::ControlServer*> told = nullptr;
  recorder::RecorderOptions settings;
  settings.data_dir = common.data_dir;
  settings.station = common.station;
  if (const Status read = words.Apply(settings); !read) return program::Fail(kName, read.error());
  if (all_topics) settings.wanted = [](const ircp::RawTopic&) { return true; };
  settings.on_change = [&told](const std::string& state, const std::string& detail) {
    if (ircp::ControlServer* const server = told) server->SetState(state, detail);
  };
  auto recorder = recorder::Recorder::Create(**participant, clock, *log,
                                             bus::Decode<ircp::StatusSample>, std::move(settings));
  if (!recorder) return program::Fail(kName, recorder.error());
  api::RecorderApi& api = **recorder;

  auto server_of_commands = ircp::ControlServer::Create(
      **participant, clock, "recorder",
      [&api](const ircp::CommandSample& command) { return recorder::AnswerCommand(api, command); });
  if (!server_of_commands) return program::Fail(kName, server_of_commands.error());
  control = std::move(*server_of_commands);
  control->SetValues([&api] { return recorder::StatusValues(*api.GetStatus()); });
  control->SetOnRival([&log](const std::string& writer) {
    log->Warning("another recorder runs in this station: both obey the same commands",
                 {{"writer", writer}, {"advice", "end one of them, or give it its own --station"}});
  });
  const api::RecorderStatus status = *api.GetStatus();
  control->SetState(status.state, status.detail);
  told = control.get();

  rpc::CallLog calls(*log);
  auto server = rpc::Server::Create(
      {.listen = common.listen,
       .port_file = common.port_file,
       .on_call = [&calls](const rpc::CallRecord& call) { calls.Record(call); }},
      {.recorder = &api});
  if (!server) return program::Fail(kName, server.error());
  std::vector<Metric> figures = recorder::MetricsOf(api);
  for (Metric& metric : rpc::MetricsOf(calls, "exemplar_recorder")) {
    figures.push_back(std::move(metric));
  }
  const auto metrics = program::ServeMetrics(common, std::move(figures));
  if (!metrics) return program::Fail(kName, metrics.error());
  log->Info("ready", {{"address", (*server)->address()}, {"data_dir", common.data_dir}});
  signals.Wait();
  (*server)->Shutdown(std::chrono::seconds(1));
  (*recorder)->Close();
  told = nullptr;
  control.reset();
  return 0;
}
