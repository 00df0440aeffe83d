// exemplar-learning: trials in, skills and motions out, over gRPC.

#include "exemplar/base/clock.hpp"
#include "exemplar/bus/mcap_trial.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/rpc/call_log.hpp"
#include "exemplar/rpc/server.hpp"
#include "learning/data.hpp"
#include "learning/metrics.hpp"
#include "learning/skills.hpp"
#include "learning/store.hpp"
#include "learning/trials.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "exemplar-learning";
  std::string robot_folder;
  program::Options options(
      kName, "Keeps trials, learns skills from them and answers queries",
      "exemplar-learning --listen 127.0.0.1:50051 --data-dir /var/lib/exemplar/learning "
      "--robot deploy/models/arm7",
      {.server = true, .data = true});
  options.Add("--robot", robot_folder,
              "folder with robot.yaml and the URDF: for trials with joints but no poses");
  learning_service::Retention retention;
  constexpr double kLongest = 1e5;
  options
      .Add("--keep-trials-days", retention.keep_trials_days,
           "trials go so many days after they came; 0: never")
      .MinMax(0, kLongest)
      .Add("--keep-versions-days", retention.keep_versions_days,
           "former skill versions go so many days after they were learned; 0: never")
      .MinMax(0, kLongest)
      .Add("--expire-needed-trials", retention.needed_too,
           "trials go as well where a current skill version was learned from them");
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
  const auto store = learning_service::Store::Open(common.data_dir);
  if (!store) return program::Fail(kName, store.error());

  learning_service::Trials trials(**store, clock, tool, bus::ReadTrialFromMcap);
  learning_service::Skills skills(**store, trials, clock, tool, *log);
  learning_service::Data data(**store, skills, clock, *log, retention);
  rpc::CallLog calls(*log);
  const auto server =
      rpc::Server::Create({.listen = common.listen,
                           .port_file = common.port_file,
                           .credentials = common.server,
                           .log = log.get(),
                           .on_call = [&](const rpc::CallRecord& call) { calls.Record(call); }},
                          {.trials = &trials, .skills = &skills, .learning_data = &data});
  if (!server) return program::Fail(kName, server.error());
  const auto metrics = program::ServeMetrics(
      common,
      learning_service::MetricsOf(rpc::MetricsOf(calls, "exemplar_learning"), trials, skills));
  if (!metrics) return program::Fail(kName, metrics.error());
  log->Info("ready", {{"address", (*server)->address()}, {"data_dir", common.data_dir}});
  signals.Wait();
  log->Info("stopping");
  (*server)->Shutdown(std::chrono::seconds(2));
  return 0;
}
