#pragma once
// Services whose answers are written down here: what they do is not under test, only what happens
// on the way to them and back.

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "exemplar/api/services.hpp"
#include "random_values.hpp"

namespace exemplar::rpc {

using std::chrono::seconds;

/// Opens once; whoever waits goes on.
class Gate {
 public:
  void Open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
    opened_.notify_all();
  }
  bool Wait() {
    std::unique_lock lock(mutex_);
    return opened_.wait_for(lock, seconds(20), [this] { return open_; });
  }
  /// False: `stop` came instead.
  bool Wait(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    return opened_.wait(lock, stop, [this] { return open_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable_any opened_;
  bool open_ = false;
};

/// Keeps files in memory; fails with `failure` where it is set.
class ScriptedTrials final : public api::TrialApi {
 public:
  Result<api::SubmitResult> Submit(const std::string& skill, const std::string& name,
                                   std::string file, const std::string& person) override {
    if (failure) return *failure;
    last_file = std::move(file);
    api::SubmitResult result;
    result.info.skill = skill;
    result.info.source = name;
    result.info.person = person;
    result.duplicate = true;
    return result;
  }
  Result<std::vector<api::TrialInfo>> List(const std::string& skill,
                                           const std::string& person) override {
    if (failure) return *failure;
    Rng rng(1);
    std::vector<api::TrialInfo> list = {RandomTrialInfo(rng), RandomTrialInfo(rng)};
    list[1].skill = skill;
    list[1].person = person;
    return list;
  }
  Result<api::TrialInfo> Get(const std::string& id) override {
    if (id == "throw") throw std::runtime_error("thrown on purpose");
    if (failure) return *failure;
    api::TrialInfo info;
    info.id = id;
    return info;
  }
  Result<demonstration::Trial> Load(const std::string&) override {
    Rng rng(2);
    return RandomTrial(rng);
  }
  Result<api::TrialSegments> Segments(const std::string& id,
                                      const std::map<std::string, std::string>& options) override {
    api::TrialSegments segments;
    segments.id = id + ":" + options.at("rule");
    return segments;
  }
  Result<api::TrialSegments> SegmentsOfFile(const std::string& name, std::string file,
                                            const std::map<std::string, std::string>&) override {
    last_file = std::move(file);
    api::TrialSegments segments;
    segments.id = name;
    return segments;
  }
  Result<std::string> ExportCsv(const std::string&) override { return last_file; }
  Status Delete(const std::string&) override {
    if (failure) return *failure;
    return {};
  }

  std::optional<Error> failure;
  std::string last_file;
};

/// Learns until it is told to stop.
class ScriptedSkills final : public api::SkillApi {
 public:
  Result<learning::SkillReport> Learn(const std::string& name,
                                      const std::map<std::string, std::string>& options,
                                      const learning::Progress& progress,
                                      std::stop_token stop) override {
    progress(0.5, "half");
    if (name == "endless") {
      learning_began.Open();
      never_.Wait(stop);
      learning_stopped.Open();
      return Error{ErrorCode::kCancelled, "learning was cancelled"};
    }
    learning::SkillReport report;
    report.skill = name;
    report.options = options;
    return report;
  }
  Result<std::vector<api::SkillInfo>> List() override { return std::vector<api::SkillInfo>(2); }
  Result<learning::SkillReport> Show(const std::string& name, int version) override {
    learning::SkillReport report;
    report.skill = name;
    report.version = version;
    return report;
  }
  Result<std::vector<api::VersionInfo>> Versions(const std::string&) override {
    return std::vector<api::VersionInfo>(3);
  }
  Status Rollback(const std::string&, int version) override {
    rolled_back_to = version;
    return {};
  }
  Status Delete(const std::string&) override { return {}; }
  Result<demonstration::SkillMotion> Query(const std::string& name, int version,
                                           const demonstration::SkillQuery& query) override {
    if (query.objects.empty()) return NotFound("no object is given", "objects");
    demonstration::SkillMotion motion;
    motion.skill = name;
    motion.version = version;
    motion.time_s = {0};
    motion.joints.resize(1, 0);
    motion.objectivity.resize(1, 0);
    motion.objects = query.objects;
    return motion;
  }
  Result<learning::Evaluation> Evaluate(const std::string&, int, const std::string&,
                                        std::string file) override {
    learning::Evaluation evaluation;
    evaluation.answer.joints.resize(0, 0);
    evaluation.deviation.frechet_m = static_cast<double>(file.size());
    return evaluation;
  }
  Result<learning::Suggestions> Suggest(const std::string& name, int version,
                                        const learning::SuggestOptions& options) override {
    learning::Suggestions suggestions;
    for (int k = 0; k < options.count; ++k) {
      suggestions.places.push_back({.target = {name, geometry::Pose::Identity(), true},
                                    .sigma_m = 0.01 * version,
                                    .nearest_trial_m = 0.2,
                                    .reason = "a gap"});
    }
    suggestions.typical_sigma_m = 0.004;
    suggestions.notes = {"never turned"};
    return suggestions;
  }
  Result<std::string> ExportJson(const std::string&, int) override { return std::string("{}"); }

  Gate learning_began, learning_stopped;
  std::atomic<int> rolled_back_to = 0;

 private:
  Gate never_;
};

/// Moves until `finish` opens or it is told to stop.
class ScriptedExecutor final : public api::ExecutorApi {
 public:
  Result<api::PlanSummary> Plan(const api::ExecuteRequest&) override {
    return FailedPrecondition("at 1.2 s forearm and table meet, 3 mm deep");
  }
  Result<api::ExecutionResult> Execute(
      const api::ExecuteRequest& request,
      const std::function<void(const api::ExecutionFeedback&)>& feedback,
      std::stop_token stop) override {
    feedback({.state = "planning"});
    feedback({.state = "executing", .time_s = 1, .duration_s = 4});
    const bool finished = finish.Wait(stop);
    ended.Open();
    api::ExecutionResult result;
    result.state = finished ? "done" : "aborted";
    result.detail = "asked by " + request.client;
    return result;
  }
  Result<api::RobotStatus> GetStatus() override {
    api::RobotStatus status;
    status.state = "idle";
    return status;
  }
  Status Pause() override { return Note("pause"); }
  Status Resume() override { return Note("resume"); }
  Status Cancel() override { return Note("cancel"); }
  Status Stop() override { return Note("stop"); }
  Status Reset() override { return Note("reset"); }
  Status SetSpeed(double factor) override { return Note("speed " + std::to_string(factor)); }
  Result<api::TeleoperationResult> Teleoperate(
      const api::TeleoperationRequest& request,
      const std::function<void(const api::TeleoperationFeedback&)>& feedback,
      std::stop_token stop) override {
    if (request.suit == "none") return Unavailable("nothing was heard");
    api::TeleoperationFeedback now;
    now.state = "teleoperating";
    now.phase = "holding";
    feedback(now);
    const bool finished = finish.Wait(stop);
    ended.Open();
    api::TeleoperationResult result;
    result.state = finished ? "done" : "aborted";
    return result;
  }
  Status EndTeleoperation() override {
    finish.Open();
    return Note("end teleoperation");
  }

  Gate finish, ended;
  std::vector<std::string> notes;

 private:
  Status Note(std::string note) {
    notes.push_back(std::move(note));
    return {};
  }
};

}  // namespace exemplar::rpc
