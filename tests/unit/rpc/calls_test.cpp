// Servers and clients on loopback, port 0. The services behind them are scripted here: what they do
// is not under test, only what happens on the way to them and back.

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <thread>

#include "exemplar/rpc/call_log.hpp"
#include "exemplar/rpc/client.hpp"
#include "exemplar/rpc/server.hpp"
#include "random_values.hpp"

namespace exemplar::rpc {
namespace {

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
                                   std::string file) override {
    if (failure) return *failure;
    last_file = std::move(file);
    api::SubmitResult result;
    result.info.skill = skill;
    result.info.source = name;
    result.duplicate = true;
    return result;
  }
  Result<std::vector<api::TrialInfo>> List(const std::string& skill) override {
    if (failure) return *failure;
    Rng rng(1);
    std::vector<api::TrialInfo> list = {RandomTrialInfo(rng), RandomTrialInfo(rng)};
    list[1].skill = skill;
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
      const api::ExecuteRequest&,
      const std::function<void(const api::ExecutionFeedback&)>& feedback,
      std::stop_token stop) override {
    feedback({.state = "planning"});
    feedback({.state = "executing", .time_s = 1, .duration_s = 4});
    const bool finished = finish.Wait(stop);
    ended.Open();
    api::ExecutionResult result;
    result.state = finished ? "done" : "aborted";
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

  Gate finish, ended;
  std::vector<std::string> notes;

 private:
  Status Note(std::string note) {
    notes.push_back(std::move(note));
    return {};
  }
};

api::ExecuteRequest Press() {
  api::ExecuteRequest request;
  request.skill = "press";
  return request;
}

class CallsTest : public testing::Test {
 protected:
  void Start(ServerOptions options = {}) {
    auto created =
        Server::Create(options, {.trials = &trials_, .skills = &skills_, .executor = &executor_});
    ASSERT_TRUE(created.ok()) << created.error().message;
    server_ = *std::move(created);
    Connect({.server = server_->address()});
  }
  void Connect(const ClientOptions& options) {
    auto connected = rpc::Connect(options);
    ASSERT_TRUE(connected.ok()) << connected.error().message;
    clients_ = *std::move(connected);
  }

  ScriptedTrials trials_;
  ScriptedSkills skills_;
  ScriptedExecutor executor_;
  std::unique_ptr<Server> server_;
  Clients clients_;
};

TEST_F(CallsTest, EveryErrorKeepsCodeMessageAndField) {
  Start();
  for (const ErrorCode code :
       {ErrorCode::kInvalidArgument, ErrorCode::kNotFound, ErrorCode::kAlreadyExists,
        ErrorCode::kFailedPrecondition, ErrorCode::kUnavailable, ErrorCode::kResourceExhausted,
        ErrorCode::kDeadlineExceeded, ErrorCode::kCancelled, ErrorCode::kDataLoss,
        ErrorCode::kInternal}) {
    const Error error{code, "größe is -2, must be positive", "objects[0].pose"};
    trials_.failure = error;
    EXPECT_EQ(clients_.trials->Get("x").error(), error);
    EXPECT_EQ(clients_.trials->List("x").error(), error);
    EXPECT_EQ(clients_.trials->Submit("x", "y", "z").error(), error);
    EXPECT_EQ(clients_.trials->Delete("x").error(), error);
  }
}

TEST_F(CallsTest, ALongErrorArrivesCut) {
  Start();
  trials_.failure = InvalidArgument(std::string(100'000, 'x'), std::string(10'000, 'f'));
  const auto got = clients_.trials->Get("x");
  ASSERT_FALSE(got.ok());
  EXPECT_EQ(got.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(got.error().message.find_first_not_of('x'), std::string::npos);
  EXPECT_GT(got.error().message.size(), 1000u);
}

TEST_F(CallsTest, AnExceptionBecomesAnInternalErrorAndTheServerLives) {
  Start();
  const auto got = clients_.trials->Get("throw");
  ASSERT_FALSE(got.ok());
  EXPECT_EQ(got.error().code, ErrorCode::kInternal);
  EXPECT_NE(got.error().message.find("thrown on purpose"), std::string::npos);
  EXPECT_TRUE(clients_.trials->Get("x").ok());
}

TEST_F(CallsTest, FilesOfManyChunksArriveWhole) {
  Start();
  Rng rng(7);
  for (const std::size_t size : {0, 1, 262'144, 262'145, 5'000'000}) {
    std::string file(size, '\0');
    for (char& c : file) c = static_cast<char>(rng.NextBits());
    const auto submitted = clients_.trials->Submit("press", "trial.mcap", file);
    ASSERT_TRUE(submitted.ok()) << submitted.error().message;
    EXPECT_EQ(trials_.last_file, file);
    EXPECT_EQ(submitted->info.skill, "press");
    EXPECT_EQ(submitted->info.source, "trial.mcap");
    EXPECT_TRUE(submitted->duplicate);
    const auto exported = clients_.trials->ExportCsv("x");
    ASSERT_TRUE(exported.ok());
    EXPECT_EQ(*exported, file);
    const auto evaluated = clients_.skills->Evaluate("press", 0, "trial.csv", file);
    ASSERT_TRUE(evaluated.ok()) << evaluated.error().message;
    EXPECT_EQ(evaluated->deviation.frechet_m, static_cast<double>(size));
  }
}

TEST_F(CallsTest, AFileOverTheLimitIsRefused) {
  ServerOptions options;
  options.max_file_bytes = 1'000'000;
  Start(options);
  const auto submitted = clients_.trials->Submit("press", "big.csv", std::string(3'000'000, 'x'));
  ASSERT_FALSE(submitted.ok());
  EXPECT_EQ(submitted.error().code, ErrorCode::kResourceExhausted);
  EXPECT_TRUE(clients_.trials->Submit("press", "small.csv", "x").ok());
}

TEST_F(CallsTest, TrialsArriveWithTheirSamples) {
  Start();
  Rng rng(2);
  const auto loaded = clients_.trials->Load("x");
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_TRUE(SameContent(*loaded, RandomTrial(rng)));
  const auto list = clients_.trials->List("press");
  ASSERT_TRUE(list.ok());
  ASSERT_EQ(list->size(), 2u);
  EXPECT_EQ((*list)[1].skill, "press");
}

TEST_F(CallsTest, SegmentsAreAskedOfATrialOrOfAFile) {
  Start();
  EXPECT_EQ(clients_.trials->Segments("trial-1", {{"rule", "literal"}})->id, "trial-1:literal");
  EXPECT_EQ(clients_.trials->SegmentsOfFile("a.csv", "bytes", {})->id, "a.csv");
  EXPECT_EQ(trials_.last_file, "bytes");
}

TEST_F(CallsTest, LearningStreamsProgressAndEndsWithTheReport) {
  Start();
  const auto report = clients_.skills->Learn("press", {{"method", "paper"}},
                                             [](double fraction, std::string_view step) {
                                               EXPECT_EQ(fraction, 0.5);
                                               EXPECT_EQ(step, "half");
                                             },
                                             {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->skill, "press");
  EXPECT_EQ(report->options.at("method"), "paper");
}

TEST_F(CallsTest, AStopOnTheClientsSideStopsTheServersWork) {
  Start();
  std::stop_source stop;
  const auto report = clients_.skills->Learn(
      "endless", {}, [&](double, std::string_view) { stop.request_stop(); }, stop.get_token());
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(skills_.learning_stopped.Wait());
}

TEST_F(CallsTest, RunningOutOfTimeStopsTheServersWork) {
  Start();
  Connect({.server = server_->address(), .long_timeout = std::chrono::milliseconds(50)});
  const auto report = clients_.skills->Learn("endless", {}, {}, {});
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().code, ErrorCode::kDeadlineExceeded);
  EXPECT_TRUE(skills_.learning_stopped.Wait());
}

TEST_F(CallsTest, ShutdownStopsCallsThatRun) {
  Start();
  std::jthread shutdown([&] {
    EXPECT_TRUE(skills_.learning_began.Wait());
    server_->Shutdown(seconds(10));
  });
  const auto report = clients_.skills->Learn("endless", {}, {}, {});
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().code, ErrorCode::kUnavailable);
  EXPECT_TRUE(skills_.learning_stopped.Wait());
}

TEST_F(CallsTest, QueriesNameTheFieldOfTheRequest) {
  Start();
  const auto motion = clients_.skills->Query("press", 2, {});
  ASSERT_FALSE(motion.ok());
  EXPECT_EQ(motion.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(motion.error().field, "query.objects");
}

TEST_F(CallsTest, AStreamAnswersQuestionAfterQuestionAndOutlivesBadOnes) {
  Start();
  const auto stream = OpenMotionStream({.server = server_->address()}, "press", 2);
  ASSERT_TRUE(stream.ok());
  Rng rng(3);
  for (int i = 0; i < 20; ++i) {
    demonstration::SkillQuery query;
    if (i % 5 != 4) query.objects = {RandomNamedPose(rng)};
    const auto motion = (*stream)->Ask(query);
    if (query.objects.empty()) {
      EXPECT_EQ(motion.error().code, ErrorCode::kNotFound);
      continue;
    }
    ASSERT_TRUE(motion.ok()) << motion.error().message;
    EXPECT_EQ(motion->skill, "press");
    EXPECT_EQ(motion->version, 2);
    EXPECT_EQ(motion->objects.at(0).name, query.objects[0].name);
  }
}

TEST_F(CallsTest, AStreamToNobodySaysSo) {
  const auto stream = OpenMotionStream({.server = "127.0.0.1:1"}, "press", 0);
  ASSERT_TRUE(stream.ok());
  EXPECT_EQ((*stream)->Ask({}).error().code, ErrorCode::kUnavailable);
  EXPECT_EQ((*stream)->Ask({}).error().code, ErrorCode::kUnavailable);
}

TEST_F(CallsTest, SkillCallsArriveWithTheirArguments) {
  Start();
  EXPECT_EQ(clients_.skills->Show("press", 3)->version, 3);
  EXPECT_EQ(clients_.skills->List()->size(), 2u);
  EXPECT_EQ(clients_.skills->Versions("press")->size(), 3u);
  EXPECT_TRUE(clients_.skills->Rollback("press", 4).ok());
  EXPECT_EQ(skills_.rolled_back_to, 4);
  const auto suggested = clients_.skills->Suggest("press", 2, {.count = 4});
  ASSERT_TRUE(suggested.ok()) << suggested.error().message;
  ASSERT_EQ(suggested->places.size(), 4u);
  EXPECT_EQ(suggested->places[3].target.name, "press");
  EXPECT_EQ(suggested->places[3].sigma_m, 0.02);
  EXPECT_EQ(suggested->places[3].nearest_trial_m, 0.2);
  EXPECT_EQ(suggested->places[3].reason, "a gap");
  EXPECT_EQ(suggested->typical_sigma_m, 0.004);
  EXPECT_EQ(suggested->notes.at(0), "never turned");
  EXPECT_TRUE(clients_.skills->Delete("press").ok());
  EXPECT_EQ(*clients_.skills->ExportJson("press", 1), "{}");
}

TEST_F(CallsTest, ExecutionStreamsFeedbackAndEndsWithTheResult) {
  Start();
  std::string last_state;
  const auto result = clients_.executor->Execute(Press(),
                                                 [&](const api::ExecutionFeedback& now) {
                                                   last_state = now.state;
                                                   if (now.state == "executing")
                                                     executor_.finish.Open();
                                                 },
                                                 {});
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->state, "done");
  EXPECT_EQ(last_state, "executing");
}

TEST_F(CallsTest, CancellingAnExecutionReachesTheRobot) {
  Start();
  std::stop_source stop;
  const auto result = clients_.executor->Execute(
      Press(), [&](const api::ExecutionFeedback&) { stop.request_stop(); }, stop.get_token());
  EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(executor_.ended.Wait());
}

TEST_F(CallsTest, ADetachedMotionOutlivesItsCall) {
  Start();
  api::ExecuteRequest request = Press();
  request.detached = true;
  const auto moving = clients_.executor->Execute(request, {}, {});
  ASSERT_TRUE(moving.ok()) << moving.error().message;
  EXPECT_EQ(moving->state, "executing");
  executor_.finish.Open();
  EXPECT_TRUE(executor_.ended.Wait());
}

TEST_F(CallsTest, ShutdownEndsADetachedMotion) {
  Start();
  api::ExecuteRequest request = Press();
  request.detached = true;
  ASSERT_TRUE(clients_.executor->Execute(request, {}, {}).ok());
  server_.reset();
  EXPECT_TRUE(executor_.ended.Wait());
}

TEST_F(CallsTest, RobotCommandsArrive) {
  Start();
  EXPECT_TRUE(clients_.executor->Pause().ok());
  EXPECT_TRUE(clients_.executor->Resume().ok());
  EXPECT_TRUE(clients_.executor->Cancel().ok());
  EXPECT_TRUE(clients_.executor->Stop().ok());
  EXPECT_TRUE(clients_.executor->Reset().ok());
  EXPECT_TRUE(clients_.executor->SetSpeed(0.5).ok());
  EXPECT_EQ(executor_.notes, (std::vector<std::string>{"pause", "resume", "cancel", "stop", "reset",
                                                       "speed 0.500000"}));
  EXPECT_EQ(clients_.executor->SetSpeed(2).error().field, "factor");
  EXPECT_EQ(clients_.executor->GetStatus()->state, "idle");
  EXPECT_EQ(clients_.executor->Plan(Press()).error().message,
            "at 1.2 s forearm and table meet, 3 mm deep");
}

TEST_F(CallsTest, AServiceThatIsNotServedIsNamed) {
  Start();
  const auto status = clients_.recorder->GetStatus();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_NE(status.error().message.find(server_->address()), std::string::npos);
}

TEST_F(CallsTest, NobodyAnsweringIsSaidWithTheAddress) {
  Connect({.server = "127.0.0.1:1"});
  const auto list = clients_.trials->List("");
  ASSERT_FALSE(list.ok());
  EXPECT_EQ(list.error().code, ErrorCode::kUnavailable);
  EXPECT_NE(list.error().message.find("127.0.0.1:1"), std::string::npos);
}

TEST_F(CallsTest, CallsAreReportedWithTheirRequestId) {
  std::mutex mutex;
  std::vector<std::string> records;
  ServerOptions options;
  options.on_call = [&](const CallRecord& call) {
    const std::lock_guard lock(mutex);
    records.push_back(std::string(call.method) + " " + std::string(call.request_id) + " " +
                      (call.status ? "ok" : std::string(ToString(call.status.error().code))));
  };
  Start(options);
  Connect({.server = server_->address(), .request_id = "mine"});
  EXPECT_TRUE(clients_.trials->Get("x").ok());
  trials_.failure = NotFound("no");
  EXPECT_FALSE(clients_.trials->Get("x").ok());
  server_.reset();
  EXPECT_EQ(records, (std::vector<std::string>{"exemplar.v1.TrialService/Get mine-1 ok",
                                               "exemplar.v1.TrialService/Get mine-2 not_found"}));
}

TEST(CallLogTest, SumsCallsByMethodAndOutcome) {
  NullLog log;
  CallLog calls(log);
  const auto record = [&](Status status) {
    calls.Record({.method = "S/M", .status = std::move(status), .duration = seconds(2)});
  };
  record({});
  record({});
  record(NotFound("no"));
  const auto figures = calls.figures();
  ASSERT_EQ(figures.size(), 2u);
  EXPECT_EQ(figures[0].code, "not_found");
  EXPECT_EQ(figures[0].calls, 1u);
  EXPECT_EQ(figures[1].code, "ok");
  EXPECT_EQ(figures[1].calls, 2u);
  EXPECT_EQ(figures[1].seconds, 4);
}

TEST(ServerTest, WritesItsPortToAFile) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "exemplar-port-file";
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / "port";
  auto server = Server::Create({.port_file = file}, {});
  ASSERT_TRUE(server.ok()) << server.error().message;
  int port = 0;
  std::ifstream(file) >> port;
  EXPECT_GT(port, 0);
  EXPECT_EQ(port, (*server)->port());
  EXPECT_EQ((*server)->address(), "127.0.0.1:" + std::to_string(port));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
  std::filesystem::remove_all(folder);
}

TEST(ServerTest, RefusesAPortThatIsTaken) {
  const auto first = Server::Create({}, {});
  ASSERT_TRUE(first.ok());
  const auto second = Server::Create({.listen = (*first)->address()}, {});
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kUnavailable);
  EXPECT_NE(second.error().message.find((*first)->address()), std::string::npos);
}

TEST(ServerTest, RefusesAddressesThatAreNone) {
  for (const char* address : {"", "localhost", ":50051", "localhost:x", "localhost:70000"}) {
    const auto server = Server::Create({.listen = address}, {});
    ASSERT_FALSE(server.ok()) << address;
    EXPECT_EQ(server.error().code, ErrorCode::kInvalidArgument) << address;
    EXPECT_EQ(server.error().field, "listen");
    const auto client = Connect({.server = address});
    ASSERT_FALSE(client.ok()) << address;
    EXPECT_EQ(client.error().field, "server");
  }
}

}  // namespace
}  // namespace exemplar::rpc
