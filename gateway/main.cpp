// exemplar-gateway: one address for every service of the system, and the station's topics for
// clients that do not speak DDS.

#include "exemplar/bus/codec.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/bus/station_clock.hpp"
#include "exemplar/program/network.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/rpc/call_log.hpp"
#include "exemplar/rpc/server.hpp"
#include "gateway/control.hpp"
#include "gateway/foxglove_side.hpp"
#include "gateway/http_side.hpp"
#include "gateway/known_topics.hpp"
#include "gateway/metrics.hpp"
#include "gateway/program_options.hpp"
#include "gateway/ros2_side.hpp"
#include "gateway/topic_hub.hpp"
#include "gateway/topic_server.hpp"
#include "gateway/web_side.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "exemplar-gateway";
  program::Options options(
      kName, "One address for every service of the system, and the station's topics",
      "exemplar-gateway --station lab --listen 127.0.0.1:50050 --learning 127.0.0.1:50051 "
      "--executor 127.0.0.1:50052 --recorder 127.0.0.1:50053 --http 127.0.0.1:8080",
      {.bus = true, .server = true, .clock = true, .client = true});
  gateway::ProgramOptions words;
  words.AddTo(options);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  const program::CommonOptions& common = options.common();

  program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(common, "gateway");
  bus::ParticipantOptions network = program::NetworkOf(common, kName, log.get());
  auto time = bus::StationClock::Create(common.clock, network, "gateway", signals.token());
  if (!time) return program::Fail(kName, time.error());
  const Clock& clock = **time;
  auto participant = bus::Participant::Create(network);
  if (!participant) return program::Fail(kName, participant.error());

  auto hub = gateway::TopicHub::Create(**participant, **participant, clock,
                                       {.publish = words.publish,
                                        .known = gateway::KnownTopics(),
                                        .decode_status = bus::Decode<ircp::StatusSample>,
                                        .max_subscriptions = 4096});
  if (!hub) return program::Fail(kName, hub.error());
  gateway::TopicServer topics(**hub, {.queue = words.queue});
  rpc::CallLog calls(*log);
  auto server = rpc::Server::Create(
      {.listen = common.listen,
       .port_file = common.port_file,
       .credentials = common.server,
       .log = log.get(),
       .on_call = [&calls](const rpc::CallRecord& call) { calls.Record(call); }},
      {.topics = &topics, .backends = words.Backends(common)});
  if (!server) return program::Fail(kName, server.error());
  auto control = gateway::OpenControl(**participant, clock, **hub);
  if (!control) return program::Fail(kName, control.error());
  (*control)->SetState("ready", (*server)->address());

  std::vector<Metric> figures = rpc::MetricsOf(calls, "exemplar_gateway");
  for (const auto& more : {gateway::MetricsOf(**hub), gateway::MetricsOf(**server)}) {
    figures.insert(figures.end(), more.begin(), more.end());
  }
  std::unique_ptr<gateway::Ros2Side> ros2;
  if (words.ros2) {
    auto made =
        gateway::Ros2Side::Create(words, common, **participant, clock, time->is_simulated(), *log);
    if (!made) return program::Fail(kName, made.error());
    ros2 = std::move(*made);
    for (Metric& metric : ros2->metrics()) figures.push_back(std::move(metric));
  }
  std::unique_ptr<gateway::HttpSide> http;
  std::unique_ptr<gateway::FoxgloveSide> foxglove;
  if (!words.http.empty()) {
    auto made = gateway::HttpSide::Create(words, common, **server, *log);
    if (!made) return program::Fail(kName, made.error());
    http = std::move(*made);
    auto drawn = gateway::FoxgloveSide::Create(words, common, **hub, http->calls(), http->server(),
                                               clock, time->is_simulated(), *log);
    if (!drawn) return program::Fail(kName, drawn.error());
    foxglove = std::move(*drawn);
    if (const Status added = gateway::AddWebSide(words, http->server(), *log); !added) {
      return program::Fail(kName, added.error());
    }
    for (Metric& metric : http::MetricsOf(http->server())) figures.push_back(std::move(metric));
    for (Metric& metric : foxglove->metrics()) figures.push_back(std::move(metric));
    if (const Status started = http->Start(figures); !started) {
      return program::Fail(kName, started.error());
    }
  }
  const auto metrics = program::ServeMetrics(common, std::move(figures));
  if (!metrics) return program::Fail(kName, metrics.error());
  log->Info("ready", {{"address", (*server)->address()}, {"station", common.station}});
  // The simulated time need not wait for who only looks on.
  NullLog unsaid;
  time->Begin(ircp::NetworkClock::Caller::kOnlyWaits, unsaid, signals.token());
  signals.Wait();
  if (http) http->Stop();
  (*server)->Shutdown(std::chrono::seconds(1));
  return 0;
}
