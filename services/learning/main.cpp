// exemplar-learning: trials in, skills and motions out, over gRPC.

#include "exemplar/base/clock.hpp"
#include "exemplar/bus/mcap_trial.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/rpc/call_log.hpp"
#include "exemplar/rpc/server.hpp"
#include "learning/skills.hpp"
#include "learning/store.hpp"
#include "learning/trials.hpp"

namespace {

using namespace exemplar;

std::vector<program::Metric> MetricsOf(const rpc::CallLog& calls) {
  const auto each = [&calls](double (*value)(const rpc::CallLog::Figure&)) {
    return [&calls, value] {
      std::vector<program::Metric::Value> values;
      for (const rpc::CallLog::Figure& figure : calls.figures()) {
        values.push_back({{{"method", figure.method}, {"code", figure.code}}, value(figure)});
      }
      return values;
    };
  };
  return {{.name = "exemplar_learning_calls_total",
           .help = "Finished gRPC calls",
           .counter = true,
           .values = each([](const auto& figure) { return static_cast<double>(figure.calls); })},
          {.name = "exemplar_learning_call_seconds_total",
           .help = "Time spent in finished gRPC calls",
           .counter = true,
           .values = each([](const auto& figure) { return figure.seconds; })}};
}

}  // namespace

int main(int argc, char** argv) {
  constexpr const char* kName = "exemplar-learning";
  std::string robot_folder;
  program::Options options(
      kName, "Keeps trials, learns skills from them and answers queries",
      "exemplar-learning --listen 127.0.0.1:50051 --data-dir /var/lib/exemplar/learning "
      "--robot deploy/models/arm7",
      {.server = true, .data = true});
  options.Add("--robot", robot_folder,
              "folder with robot.yaml and the URDF: for trials with joints but no poses");
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  const program::CommonOptions& common = options.common();

  const program::Signals signals;
  const std::unique_ptr<Log> log = program::MakeLog(common, "learning");
  const SystemClock clock;
  std::shared_ptr<const demonstration::ToolKinematics> tool;
  if (!robot_folder.empty()) {
    const auto robot = kinematics::ReadRobotDescription(robot_folder);
    if (!robot) return program::Fail(kName, robot.error());
    tool = std::make_shared<kinematics::Chain>(robot->chain);
  }
  if (common.data_dir.empty()) {
    return program::Fail(kName, InvalidArgument("--data-dir is missing", "data-dir"));
  }
  const auto store = learning_service::Store::Open(common.data_dir);
  if (!store) return program::Fail(kName, store.error());

  learning_service::Trials trials(**store, clock, tool, bus::ReadTrialFromMcap);
  learning_service::Skills skills(**store, trials, clock, tool, *log);
  rpc::CallLog calls(*log);
  const auto server =
      rpc::Server::Create({.listen = common.listen,
                           .port_file = common.port_file,
                           .on_call = [&](const rpc::CallRecord& call) { calls.Record(call); }},
                          {.trials = &trials, .skills = &skills});
  if (!server) return program::Fail(kName, server.error());
  std::unique_ptr<program::MetricsServer> metrics;
  if (!common.metrics.empty()) {
    auto made = program::MetricsServer::Create(common.metrics, MetricsOf(calls));
    if (!made) return program::Fail(kName, made.error());
    metrics = *std::move(made);
  }
  log->Info("ready", {{"address", (*server)->address()}, {"data_dir", common.data_dir}});
  signals.Wait();
  log->Info("stopping");
  (*server)->Shutdown(std::chrono::seconds(2));
  return 0;
}
