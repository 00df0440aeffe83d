// The scripted services' calls as JSON, through the whole of gRPC but the network.

#include <gtest/gtest.h>

#include "exemplar/rpc/server.hpp"
#include "scripted_services.hpp"

namespace exemplar::rpc {
namespace {

class JsonCallsTest : public testing::Test {
 protected:
  void SetUp() override {
    ServerOptions options;
    options.on_call = [this](const CallRecord& call) {
      const std::lock_guard lock(mutex_);
      request_ids_.emplace_back(call.request_id);
    };
    server_ =
        *Server::Create(options, {.trials = &trials_, .skills = &skills_, .executor = &executor_});
    calls_ = server_->MakeJsonCalls();
  }

  struct Outcome {
    std::vector<std::string> answers;
    std::optional<api::JsonFailure> failure;
  };
  Outcome Call(api::JsonCall call) {
    call.method = "exemplar.v1." + call.method;
    Outcome outcome;
    outcome.failure = calls_->Call(call, [&](std::string&& answer) {
      outcome.answers.push_back(std::move(answer));
      return true;
    });
    return outcome;
  }
  std::string ErrorOf(const std::string& method, const std::string& body) {
    const Outcome outcome = Call({.method = method, .body = body});
    return outcome.failure ? outcome.failure->message : "none";
  }

  ScriptedTrials trials_;
  ScriptedSkills skills_;
  ScriptedExecutor executor_;
  std::mutex mutex_;
  std::vector<std::string> request_ids_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<api::JsonCalls> calls_;
};

TEST_F(JsonCallsTest, ListsTheMethodsOfWhatIsServed) {
  int read_only = 0;
  bool submit = false;
  for (const api::JsonMethod& method : calls_->methods()) {
    EXPECT_NE(method.service, "exemplar.v1.RecorderService");
    read_only += method.read_only ? 1 : 0;
    submit = submit || (method.name == "Submit" && method.client_streaming);
  }
  EXPECT_TRUE(submit);
  EXPECT_EQ(read_only, 11);
}

TEST_F(JsonCallsTest, AnswersWithTheFieldsOfTheProto) {
  const Outcome outcome = Call({.method = "TrialService/Get", .body = R"({"id": "t-1"})"});
  ASSERT_FALSE(outcome.failure) << outcome.failure->message;
  ASSERT_EQ(outcome.answers.size(), 1U);
  EXPECT_NE(outcome.answers[0].find(R"("id":"t-1")"), std::string::npos) << outcome.answers[0];
  EXPECT_NE(outcome.answers[0].find(R"("duration_s":0)"), std::string::npos) << outcome.answers[0];
}

TEST_F(JsonCallsTest, TakesFieldsBesideTheBody) {
  Outcome outcome = Call({.method = "TrialService/Get", .fields = {{"id", "t-2"}}});
  ASSERT_FALSE(outcome.failure) << outcome.failure->message;
  EXPECT_NE(outcome.answers.at(0).find("t-2"), std::string::npos);
  outcome = Call(
      {.method = "SkillService/Get", .fields = {{"skill.name", "press"}, {"skill.version", "7"}}});
  ASSERT_FALSE(outcome.failure) << outcome.failure->message;
  EXPECT_NE(outcome.answers.at(0).find("press"), std::string::npos);
  outcome = Call({.method = "SkillService/Get", .fields = {{"skill.version", "x"}}});
  EXPECT_EQ(outcome.failure->field, "skill.version");
  outcome = Call({.method = "SkillService/Get", .fields = {{"skill", "x"}}});
  EXPECT_EQ(outcome.failure->field, "skill");
  outcome = Call({.method = "SkillService/Get", .fields = {{"skil.name", "x"}}});
  EXPECT_NE(outcome.failure->message.find("did you mean skill?"), std::string::npos);
}

TEST_F(JsonCallsTest, NamesThePlaceOfWhatIsNotJson) {
  EXPECT_EQ(ErrorOf("TrialService/Get", "{\"id\": \"a\",\n \"x\" 1}"),
            "line 2, column 6: this is not JSON");
  EXPECT_EQ(ErrorOf("TrialService/Get", "[]"), "the request must be a JSON object");
  EXPECT_EQ(ErrorOf("TrialService/Get", "{'id': 'a'}"), "line 1, column 2: this is not JSON");
  EXPECT_EQ(ErrorOf("TrialService/Get", std::string(100000, '[')), "the JSON is nested too deep");
}

TEST_F(JsonCallsTest, NamesTheFieldThatIsNotOfItsType) {
  const Outcome outcome = Call(
      {.method = "SkillService/Get", .body = R"({"skill": {"name": "press", "version": "new"}})"});
  ASSERT_TRUE(outcome.failure);
  EXPECT_EQ(outcome.failure->http_status, 400);
  EXPECT_EQ(outcome.failure->code, "invalid_argument");
  EXPECT_EQ(outcome.failure->field, "skill.version") << outcome.failure->message;
  EXPECT_EQ(ErrorOf("SkillService/Get", R"({"skill": {"nam": "press"}})"),
            "skill.nam: SkillVersion has no such field; did you mean name?");
}

TEST_F(JsonCallsTest, FailsAsTheServiceDid) {
  trials_.failure = NotFound("there is no trial \"x\"", "id");
  Outcome outcome = Call({.method = "TrialService/Get", .body = R"({"id": "x"})"});
  ASSERT_TRUE(outcome.failure);
  EXPECT_EQ(outcome.failure->http_status, 404);
  EXPECT_EQ(outcome.failure->code, "not_found");
  EXPECT_EQ(outcome.failure->message, "there is no trial \"x\"");
  EXPECT_EQ(outcome.failure->field, "id");
  outcome = Call({.method = "TrialService/Nothing"});
  EXPECT_EQ(outcome.failure->http_status, 404);
}

TEST_F(JsonCallsTest, SendsALineForEachMessageOfAStream) {
  const Outcome outcome =
      Call({.method = "TrialService/Submit",
            .body = "{\"header\": {\"skill\": \"press\", \"name\": \"a.csv\"}}\n"
                    "\n{\"chunk\": {\"data\": \"YWJj\"}}\n"
                    "{\"chunk\": {\"data\": \"ZGVm\"}}"});
  ASSERT_FALSE(outcome.failure) << outcome.failure->message;
  EXPECT_EQ(trials_.last_file, "abcdef");
  EXPECT_EQ(ErrorOf("TrialService/Submit", "{}\n{\"chunk\"}"),
            "line 2, column 9: this is not JSON");
}

TEST_F(JsonCallsTest, GivesEachAnswerOfAStreamAsItComes) {
  const Outcome outcome = Call({.method = "SkillService/Learn", .body = R"({"name": "press"})"});
  ASSERT_FALSE(outcome.failure) << outcome.failure->message;
  ASSERT_EQ(outcome.answers.size(), 2U);
  EXPECT_NE(outcome.answers[0].find(R"("fraction":0.5)"), std::string::npos) << outcome.answers[0];
}

TEST_F(JsonCallsTest, StopsTheServersWorkWhenNobodyListens) {
  const auto failure =
      calls_->Call({.method = "exemplar.v1.SkillService/Learn", .body = R"({"name": "endless"})"},
                   [](std::string&&) { return false; });
  ASSERT_TRUE(failure);
  EXPECT_EQ(failure->http_status, 499);
  EXPECT_TRUE(skills_.learning_stopped.Wait());
}

TEST_F(JsonCallsTest, StopsTheServersWorkWhenAskedTo) {
  std::stop_source stop;
  const auto failure = calls_->Call({.method = "exemplar.v1.SkillService/Learn",
                                     .body = R"({"name": "endless"})",
                                     .stop = stop.get_token()},
                                    [&stop](std::string&&) { return stop.request_stop(); });
  ASSERT_TRUE(failure);
  EXPECT_TRUE(skills_.learning_stopped.Wait());
}

TEST_F(JsonCallsTest, PassesTheRequestIdOn) {
  Call({.method = "TrialService/Get", .metadata = {{"x-request-id", "mine"}}});
  const std::lock_guard lock(mutex_);
  EXPECT_EQ(request_ids_, (std::vector<std::string>{"mine"}));
}

TEST_F(JsonCallsTest, DescribesEveryMethodAndType) {
  const std::string document = calls_->OpenApi();
  for (const char* part :
       {"\"openapi\": \"3.0.3\"", "\"/exemplar.v1.SkillService/Query\"", "application/x-ndjson",
        "\"exemplar.v1.SkillQuery\"", "#/components/schemas/exemplar.v1.Pose"}) {
    EXPECT_NE(document.find(part), std::string::npos) << part;
  }
}

}  // namespace
}  // namespace exemplar::rpc
