#include "gateway/http_api.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "unit/http/raw_client.hpp"

namespace exemplar::gateway {
namespace {

using http::testing::Reply;
using Json = nlohmann::json;

/// Answers as the test says, and keeps what it was asked.
class ScriptedCalls final : public api::JsonCalls {
 public:
  const std::vector<api::JsonMethod>& methods() const override { return methods_; }
  std::string OpenApi() const override { return R"({"openapi":"3.0.3"})"; }
  std::optional<api::JsonFailure> Call(
      const api::JsonCall& call, const std::function<bool(std::string&&)>& on_answer) override {
    last = call;
    for (std::string answer : answers) {
      if (!on_answer(std::move(answer))) return api::JsonFailure{.http_status = 499};
    }
    return failure;
  }

  api::JsonCall last;
  std::vector<std::string> answers;
  std::optional<api::JsonFailure> failure;

 private:
  const std::vector<api::JsonMethod> methods_ = {
      {.service = "v.S", .name = "Get", .read_only = true},
      {.service = "v.S", .name = "Put", .client_streaming = true},
      {.service = "v.S", .name = "Watch", .server_streaming = true}};
};

class HttpApiTest : public testing::Test {
 protected:
  void SetUp() override {
    server_ = *http::Server::Create({}, log_);
    HttpApi api;
    api.calls = &calls_;
    api.health = [] { return std::vector<HealthLine>{{"executor", "127.0.0.1:1", false}}; };
    api.metrics = [] { return std::string("exemplar_x 1\n"); };
    api.make_request_id = [] { return std::string("made"); };
    api.body_bytes = 1000;
    ASSERT_TRUE(AddRoutes(*server_, api).ok());
    server_->Start();
  }

  Reply Ask(const std::string& line, const std::string& body = {},
            const std::string& fields = {}) const {
    return http::testing::Ask(server_->port(), line, fields, body);
  }

  NullLog log_;
  ScriptedCalls calls_;
  std::unique_ptr<http::Server> server_;
};

TEST_F(HttpApiTest, TellsHealthFiguresAndTheDescription) {
  const Reply health = Ask("GET /healthz");
  EXPECT_EQ(health.status, 200);
  EXPECT_EQ(Json::parse(health.body)["status"], "degraded");
  EXPECT_EQ(Json::parse(health.body)["backends"][0]["name"], "executor");
  EXPECT_EQ(Ask("GET /metrics").body, "exemplar_x 1\n");
  EXPECT_EQ(Ask("GET /openapi.json").body, R"({"openapi":"3.0.3"})");
}

TEST_F(HttpApiTest, PassesBodyFieldsAndHeaderFieldsOn) {
  calls_.answers = {R"({"a":1})"};
  const Reply reply = Ask("POST /v.S/Get?x=1&x=2", R"({"b":2})",
                          "X-Request-Id: mine\r\nAuthorization: Bearer t\r\n"
                          "Connect-Timeout-Ms: 1500\r\n");
  EXPECT_EQ(reply.status, 200);
  EXPECT_NE(reply.head.find("X-Request-Id: mine"), std::string::npos) << reply.head;
  EXPECT_NE(reply.head.find("application/json"), std::string::npos);
  EXPECT_EQ(calls_.last.method, "v.S/Get");
  EXPECT_EQ(calls_.last.body, R"({"b":2})");
  EXPECT_EQ(calls_.last.fields.size(), 2U);
  EXPECT_EQ(calls_.last.timeout, std::chrono::milliseconds(1500));
  EXPECT_EQ(calls_.last.metadata, (std::vector<std::pair<std::string, std::string>>{
                                      {"authorization", "Bearer t"}, {"x-request-id", "mine"}}));
}

TEST_F(HttpApiTest, AsksWithGetOnlyWhatChangesNothing) {
  calls_.answers = {"{}"};
  EXPECT_EQ(Ask("GET /v.S/Get").status, 200);
  EXPECT_EQ(calls_.last.metadata.back().second, "made");
  EXPECT_EQ(Ask("GET /v.S/Put").status, 405);
  EXPECT_EQ(Ask("POST /v.S/Nothing").status, 404);
}

TEST_F(HttpApiTest, SaysWhyACallFailed) {
  calls_.failure = api::JsonFailure{404, "not_found", "there is no \"x\"", "id"};
  const Reply reply = Ask("POST /v.S/Get", "{}");
  EXPECT_EQ(reply.status, 404);
  EXPECT_EQ(Json::parse(reply.body),
            (Json{{"code", "not_found"}, {"message", "there is no \"x\""}, {"field", "id"}}));
  EXPECT_NE(reply.head.find("X-Request-Id: made"), std::string::npos);
  EXPECT_EQ(Ask("POST /v.S/Get", "{}", "Connect-Timeout-Ms: soon\r\n").status, 400);
}

TEST_F(HttpApiTest, StreamsALineForEachAnswerAndEndsWithTheFailure) {
  calls_.answers = {R"({"n":1})", R"({"n":2})"};
  calls_.failure = api::JsonFailure{503, "unavailable", "gone", ""};
  const Reply reply = Ask("POST /v.S/Watch", "{}");
  EXPECT_EQ(reply.status, 200);
  EXPECT_NE(reply.head.find("application/x-ndjson"), std::string::npos);
  EXPECT_NE(reply.body.find("{\"n\":1}\n"), std::string::npos) << reply.body;
  EXPECT_NE(reply.body.find(R"({"error":{"code":"unavailable","message":"gone"}})"),
            std::string::npos)
      << reply.body;
}

TEST_F(HttpApiTest, RefusesBodiesOverTheLimitAndServesOn) {
  EXPECT_EQ(Ask("POST /v.S/Get", std::string(1001, ' ')).status, 413);
  calls_.answers = {"{}"};
  EXPECT_EQ(Ask("POST /v.S/Put", std::string(5000, ' ')).status, 200);
}

}  // namespace
}  // namespace exemplar::gateway
