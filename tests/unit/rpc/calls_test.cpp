// Servers and clients on loopback, port 0: every call directly, and through a gateway.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <mutex>
#include <thread>

#include "exemplar/rpc/call_log.hpp"
#include "exemplar/rpc/client.hpp"
#include "exemplar/rpc/server.hpp"
#include "random_values.hpp"
#include "scripted_services.hpp"

namespace exemplar::rpc {
namespace {

api::ExecuteRequest Press() {
  api::ExecuteRequest request;
  request.skill = "press";
  return request;
}

/// The parameter: whether a gateway stands between.
class CallsTest : public testing::TestWithParam<bool> {
 protected:
  void Start(ServerOptions options = {}) {
    ServerOptions behind = options;
    if (GetParam()) behind.on_call = {};
    auto created =
        Server::Create(behind, {.trials = &trials_, .skills = &skills_, .executor = &executor_});
    ASSERT_TRUE(created.ok()) << created.error().message;
    server_ = *std::move(created);
    if (GetParam()) {
      backend_ = std::move(server_);
      auto gateway = Server::Create(
          options,
          {.backends = {{.name = "backend",
                         .connection = {.server = backend_->address()},
                         .services = {"exemplar.v1.TrialService", "exemplar.v1.SkillService",
                                      "exemplar.v1.ExecutorService"}}}});
      ASSERT_TRUE(gateway.ok()) << gateway.error().message;
      server_ = *std::move(gateway);
    }
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
  std::unique_ptr<Server> backend_;  ///< behind a gateway
  std::unique_ptr<Server> server_;   ///< that is called
  Clients clients_;
};

TEST_P(CallsTest, EveryErrorKeepsCodeMessageAndField) {
  Start();
  for (const ErrorCode code : kErrorCodes) {
    const Error error{code, "größe is -2, must be positive", "objects[0].pose"};
    trials_.failure = error;
    EXPECT_EQ(clients_.trials->Get("x").error(), error);
    EXPECT_EQ(clients_.trials->List("x").error(), error);
    EXPECT_EQ(clients_.trials->Submit("x", "y", "z").error(), error);
    EXPECT_EQ(clients_.trials->Delete("x").error(), error);
  }
}

TEST_P(CallsTest, ALongErrorArrivesCut) {
  Start();
  trials_.failure = InvalidArgument(std::string(100'000, 'x'), std::string(10'000, 'f'));
  const auto got = clients_.trials->Get("x");
  ASSERT_FALSE(got.ok());
  EXPECT_EQ(got.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(got.error().message.find_first_not_of('x'), std::string::npos);
  EXPECT_GT(got.error().message.size(), 1000u);
}

TEST_P(CallsTest, AnExceptionBecomesAnInternalErrorAndTheServerLives) {
  Start();
  const auto got = clients_.trials->Get("throw");
  ASSERT_FALSE(got.ok());
  EXPECT_EQ(got.error().code, ErrorCode::kInternal);
  EXPECT_NE(got.error().message.find("thrown on purpose"), std::string::npos);
  EXPECT_TRUE(clients_.trials->Get("x").ok());
}

TEST_P(CallsTest, FilesOfManyChunksArriveWhole) {
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

TEST_P(CallsTest, AFileOverTheLimitIsRefused) {
  ServerOptions options;
  options.max_file_bytes = 1'000'000;
  Start(options);
  const auto submitted = clients_.trials->Submit("press", "big.csv", std::string(3'000'000, 'x'));
  ASSERT_FALSE(submitted.ok());
  EXPECT_EQ(submitted.error().code, ErrorCode::kResourceExhausted);
  EXPECT_TRUE(clients_.trials->Submit("press", "small.csv", "x").ok());
}

TEST_P(CallsTest, TrialsArriveWithTheirSamples) {
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

TEST_P(CallsTest, SegmentsAreAskedOfATrialOrOfAFile) {
  Start();
  EXPECT_EQ(clients_.trials->Segments("trial-1", {{"rule", "literal"}})->id, "trial-1:literal");
  EXPECT_EQ(clients_.trials->SegmentsOfFile("a.csv", "bytes", {})->id, "a.csv");
  EXPECT_EQ(trials_.last_file, "bytes");
}

TEST_P(CallsTest, LearningStreamsProgressAndEndsWithTheReport) {
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

TEST_P(CallsTest, AStopOnTheClientsSideStopsTheServersWork) {
  Start();
  std::stop_source stop;
  const auto report = clients_.skills->Learn(
      "endless", {}, [&](double, std::string_view) { stop.request_stop(); }, stop.get_token());
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(skills_.learning_stopped.Wait());
}

TEST_P(CallsTest, RunningOutOfTimeStopsTheServersWork) {
  Start();
  Connect({.server = server_->address(), .long_timeout = std::chrono::milliseconds(50)});
  const auto report = clients_.skills->Learn("endless", {}, {}, {});
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().code, ErrorCode::kDeadlineExceeded);
  EXPECT_TRUE(skills_.learning_stopped.Wait());
}

TEST_P(CallsTest, ShutdownStopsCallsThatRun) {
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

TEST_P(CallsTest, QueriesNameTheFieldOfTheRequest) {
  Start();
  const auto motion = clients_.skills->Query("press", 2, {});
  ASSERT_FALSE(motion.ok());
  EXPECT_EQ(motion.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(motion.error().field, "query.objects");
}

TEST_P(CallsTest, AStreamAnswersQuestionAfterQuestionAndOutlivesBadOnes) {
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

TEST_P(CallsTest, AStreamToNobodySaysSo) {
  const auto stream = OpenMotionStream({.server = "127.0.0.1:1"}, "press", 0);
  ASSERT_TRUE(stream.ok());
  EXPECT_EQ((*stream)->Ask({}).error().code, ErrorCode::kUnavailable);
  EXPECT_EQ((*stream)->Ask({}).error().code, ErrorCode::kUnavailable);
}

TEST_P(CallsTest, SkillCallsArriveWithTheirArguments) {
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

TEST_P(CallsTest, ExecutionStreamsFeedbackAndEndsWithTheResult) {
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
  EXPECT_EQ(result->detail.rfind("asked by request", 0), 0U) << result->detail;
}

TEST_P(CallsTest, CancellingAnExecutionReachesTheRobot) {
  Start();
  std::stop_source stop;
  const auto result = clients_.executor->Execute(
      Press(), [&](const api::ExecutionFeedback&) { stop.request_stop(); }, stop.get_token());
  EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(executor_.ended.Wait());
}

TEST_P(CallsTest, ADetachedMotionOutlivesItsCall) {
  Start();
  api::ExecuteRequest request = Press();
  request.detached = true;
  const auto moving = clients_.executor->Execute(request, {}, {});
  ASSERT_TRUE(moving.ok()) << moving.error().message;
  EXPECT_EQ(moving->state, "executing");
  executor_.finish.Open();
  EXPECT_TRUE(executor_.ended.Wait());
}

TEST_P(CallsTest, ShutdownEndsADetachedMotion) {
  Start();
  api::ExecuteRequest request = Press();
  request.detached = true;
  ASSERT_TRUE(clients_.executor->Execute(request, {}, {}).ok());
  server_.reset();
  backend_.reset();
  EXPECT_TRUE(executor_.ended.Wait());
}

TEST_P(CallsTest, TeleoperationFeedsBackUntilItEnds) {
  Start();
  std::vector<std::string> phases;
  const auto note = [&](const api::TeleoperationFeedback& now) {
    phases.push_back(now.phase);
    EXPECT_TRUE(clients_.executor->EndTeleoperation().ok());
  };
  const auto done = clients_.executor->Teleoperate({}, note, {});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->state, "done");
  EXPECT_EQ(phases, std::vector<std::string>{"holding"});
  api::TeleoperationRequest silent;
  silent.suit = "none";
  EXPECT_EQ(clients_.executor->Teleoperate(silent, {}, {}).error().code, ErrorCode::kUnavailable);
}

TEST_P(CallsTest, ADetachedTeleoperationGoesOnWithoutItsCall) {
  Start();
  api::TeleoperationRequest request;
  request.detached = true;
  const auto on = clients_.executor->Teleoperate(request, {}, {});
  ASSERT_TRUE(on.ok()) << on.error().message;
  EXPECT_EQ(on->state, "teleoperating");
  EXPECT_TRUE(clients_.executor->EndTeleoperation().ok());
  EXPECT_TRUE(executor_.ended.Wait());
}

TEST_P(CallsTest, RobotCommandsArrive) {
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

TEST_P(CallsTest, AServiceThatIsNotServedIsNamed) {
  Start();
  const auto status = clients_.recorder->GetStatus();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kUnimplemented);
  EXPECT_NE(status.error().message.find(server_->address()), std::string::npos);
}

TEST_P(CallsTest, NobodyAnsweringIsSaidWithTheAddress) {
  Connect({.server = "127.0.0.1:1"});
  const auto list = clients_.trials->List("");
  ASSERT_FALSE(list.ok());
  EXPECT_EQ(list.error().code, ErrorCode::kUnavailable);
  EXPECT_NE(list.error().message.find("127.0.0.1:1"), std::string::npos);
}

TEST_P(CallsTest, CallsAreReportedWithTheirRequestId) {
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

INSTANTIATE_TEST_SUITE_P(AllWays, CallsTest, testing::Bool(), [](const auto& way) {
  return std::string(way.param ? "ThroughAGateway" : "Directly");
});

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
