// Real servers and clients on loopback, with certificates made here.

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <mutex>
#include <set>

#include "exemplar/rpc/client.hpp"
#include "exemplar/rpc/method_rules.hpp"
#include "exemplar/rpc/server.hpp"
#include "exemplar/security/access.hpp"
#include "exemplar/security/certificate.hpp"
#include "exemplar/security/digest.hpp"
#include "exemplar/v1/data.pb.h"
#include "exemplar/v1/executor.pb.h"
#include "exemplar/v1/recorder.pb.h"
#include "exemplar/v1/skill.pb.h"
#include "exemplar/v1/topic.pb.h"
#include "exemplar/v1/trial.pb.h"

namespace exemplar::rpc {
namespace {

using security::Role;
using testing::HasSubstr;

class Recorder final : public api::RecorderApi {
 public:
  Result<api::RecorderStatus> Start(const api::RecordStart&) override { return Said("recording"); }
  Result<api::RecorderStatus> Stop() override { return Said("stopped"); }
  Result<api::RecorderStatus> Pause() override { return Said("paused"); }
  Result<api::RecorderStatus> Resume() override { return Said("recording"); }
  Result<api::RecorderStatus> MarkEvent(const api::RecordEvent&) override { return Said("marked"); }
  /// Waits while the test holds `hold`.
  Result<api::RecorderStatus> GetStatus() override {
    const std::lock_guard lock(hold);
    return Said("ready");
  }

  std::mutex hold;

 private:
  static api::RecorderStatus Said(const std::string& state) {
    api::RecorderStatus status;
    status.state = state;
    return status;
  }
};

/// Moves nothing; a motion ends when it is told to stop.
class Executor final : public api::ExecutorApi {
 public:
  Result<api::PlanSummary> Plan(const api::ExecuteRequest&) override { return api::PlanSummary(); }
  Result<api::ExecutionResult> Execute(const api::ExecuteRequest&,
                                       const std::function<void(const api::ExecutionFeedback&)>&,
                                       std::stop_token) override {
    api::ExecutionResult result;
    result.state = "done";
    return result;
  }
  Result<api::RobotStatus> GetStatus() override { return api::RobotStatus(); }
  Status Pause() override { return {}; }
  Status Resume() override { return {}; }
  Status Cancel() override { return {}; }
  Status Stop() override { return {}; }
  Status Reset() override { return {}; }
  Status SetSpeed(double) override { return {}; }
};

struct KeptCall {
  std::string method, caller, target, outcome, request_id;
  bool audited = false;
};

class SecurityTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "exemplar-rpc-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    const Stamp now = SystemClock().Now();
    validity_ = {now - std::chrono::hours(2), now + std::chrono::hours(2)};
    authority_ = *security::MakeAuthority("lab", "lab CA", validity_);
    WriteText("ca.pem", authority_.certificate);
    WritePair("server", authority_,
              {.organisation = "lab", .name = "recorder", .hosts = {"127.0.0.1", "localhost"}});
    WritePair("anna", authority_, {.organisation = "lab", .name = "anna"});
  }
  void TearDown() override {
    server_.reset();
    std::filesystem::remove_all(folder_);
  }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  void WriteText(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  void WritePair(const std::string& name, const security::KeyPair& authority,
                 const security::Subject& subject, Duration shift = Duration::zero()) const {
    const auto pair = security::IssueCertificate(authority, subject,
                                                 {validity_.from + shift, validity_.to + shift});
    ASSERT_TRUE(pair.ok()) << pair.error().message;
    WriteText(name + ".pem", pair->certificate);
    WriteText(name + ".key", pair->key);
  }
  void WriteAccess(const security::AccessList& list) const {
    const Status written = security::WriteAccessList(folder_ / "access.yaml", list);
    ASSERT_TRUE(written.ok()) << written.error().message;
  }

  security::ServerCredentials Tls(const std::string& pair = "server") const {
    return {.certificate = Path(pair + ".pem"), .key = Path(pair + ".key")};
  }

  Result<std::unique_ptr<Server>> TryStart(ServerOptions options) {
    options.on_call = [this](const CallRecord& call) {
      const std::lock_guard lock(mutex_);
      calls_.push_back({std::string(call.method), std::string(call.caller),
                        std::string(call.target), std::string(call.outcome),
                        std::string(call.request_id), call.audited});
    };
    return Server::Create(options, {.executor = &executor_, .recorder = &recorder_});
  }
  void Start(ServerOptions options) {
    auto server = TryStart(std::move(options));
    ASSERT_TRUE(server.ok()) << server.error().message;
    server_ = std::move(*server);
  }

  Result<Clients> TryConnect(security::ClientCredentials credentials,
                             const std::string& host = "127.0.0.1") const {
    return Connect({.server = host + ":" + std::to_string(server_->port()),
                    .timeout = std::chrono::seconds(20),
                    .request_id = "test",
                    .credentials = std::move(credentials)});
  }
  Result<api::RecorderStatus> Ask(security::ClientCredentials credentials,
                                  const std::string& host = "127.0.0.1") const {
    const Result<Clients> clients = TryConnect(std::move(credentials), host);
    if (!clients) return clients.error();
    return clients->recorder->GetStatus();
  }

  std::filesystem::path folder_;
  security::Validity validity_;
  security::KeyPair authority_;
  Recorder recorder_;
  Executor executor_;
  std::unique_ptr<Server> server_;
  std::mutex mutex_;
  std::vector<KeptCall> calls_;
};

/// Every method of the package, by the descriptions that are linked in.
std::set<std::string> AllMethods() {
  std::set<std::string> names;
  for (const google::protobuf::FileDescriptor* file :
       {v1::StopRobotRequest::descriptor()->file(), v1::StopRecordingRequest::descriptor()->file(),
        v1::ListSkillsRequest::descriptor()->file(), v1::ListTopicsRequest::descriptor()->file(),
        v1::ListTrialsRequest::descriptor()->file(),
        v1::ListPersonsRequest::descriptor()->file()}) {
    for (int i = 0; i < file->service_count(); ++i) {
      for (int k = 0; k < file->service(i)->method_count(); ++k) {
        names.insert(file->service(i)->full_name() + "/" + file->service(i)->method(k)->name());
      }
    }
  }
  return names;
}

TEST(MethodRules, EveryMethodOfTheApiHasExactlyOneRule) {
  std::multiset<std::string> ruled;
  for (const MethodRule& rule : MethodRules()) ruled.insert(std::string(rule.method));
  const std::set<std::string> all = AllMethods();
  EXPECT_EQ(std::vector<std::string>(ruled.begin(), ruled.end()),
            std::vector<std::string>(all.begin(), all.end()));
}

TEST(MethodRules, WhatMovesTheRobotOrDeletesIsAudited) {
  for (const MethodRule& rule : MethodRules()) {
    const bool deletes = rule.method.ends_with("/Delete") ||
                         (rule.method.find("DataService/") != std::string_view::npos &&
                          !rule.method.ends_with("/ListPersons"));
    const bool moves = rule.method.starts_with("exemplar.v1.ExecutorService/") &&
                       !rule.method.ends_with("/GetStatus") && !rule.method.ends_with("/Plan");
    if (deletes || moves) {
      EXPECT_TRUE(rule.audited) << rule.method;
    }
  }
}

TEST_F(SecurityTest, TlsClientsOfTheSameAuthorityAreAnswered) {
  Start({.credentials = Tls()});
  const auto status = Ask({.ca = Path("ca.pem")});
  ASSERT_TRUE(status.ok()) << status.error().message;
  EXPECT_EQ(status->state, "ready");
  EXPECT_TRUE(Ask({.ca = Path("ca.pem")}, "localhost").ok());
}

TEST_F(SecurityTest, PlainClientsOfATlsServerGetNoAnswer) {
  Start({.credentials = Tls()});
  const auto status = Ask({});
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(status.error().message, HasSubstr("--tls-ca"));
}

TEST_F(SecurityTest, ServersOfAnotherAuthorityAreNotBelieved) {
  const auto other = security::MakeAuthority("lab", "lab CA", validity_);
  WritePair("other", *other, {.organisation = "lab", .name = "recorder", .hosts = {"127.0.0.1"}});
  Start({.credentials = Tls("other")});
  EXPECT_EQ(Ask({.ca = Path("ca.pem")}).error().code, ErrorCode::kUnavailable);
  EXPECT_TRUE(calls_.empty());
}

TEST_F(SecurityTest, ServersWhoseCertificateHasExpiredAreNotBelieved) {
  WritePair("old", authority_, {.organisation = "lab", .name = "r", .hosts = {"127.0.0.1"}},
            -std::chrono::hours(5));
  Start({.credentials = Tls("old")});
  EXPECT_EQ(Ask({.ca = Path("ca.pem")}).error().code, ErrorCode::kUnavailable);
}

TEST_F(SecurityTest, ServersOfAnotherHostAreNotBelieved) {
  WritePair("far", authority_, {.organisation = "lab", .name = "r", .hosts = {"recorder.lab"}});
  Start({.credentials = Tls("far")});
  EXPECT_EQ(Ask({.ca = Path("ca.pem")}).error().code, ErrorCode::kUnavailable);
}

TEST_F(SecurityTest, CallersNeedACertificateOfTheClientAuthority) {
  security::ServerCredentials credentials = Tls();
  credentials.client_ca = Path("ca.pem");
  Start({.credentials = credentials});
  EXPECT_FALSE(Ask({.ca = Path("ca.pem")}).ok());

  const auto other = security::MakeAuthority("lab", "lab CA", validity_);
  WritePair("stranger", *other, {.organisation = "lab", .name = "anna"});
  EXPECT_FALSE(
      Ask({.ca = Path("ca.pem"), .certificate = Path("stranger.pem"), .key = Path("stranger.key")})
          .ok());
  WritePair("late", authority_, {.organisation = "lab", .name = "anna"}, -std::chrono::hours(5));
  EXPECT_FALSE(
      Ask({.ca = Path("ca.pem"), .certificate = Path("late.pem"), .key = Path("late.key")}).ok());
  EXPECT_TRUE(calls_.empty());

  const auto status =
      Ask({.ca = Path("ca.pem"), .certificate = Path("anna.pem"), .key = Path("anna.key")});
  ASSERT_TRUE(status.ok()) << status.error().message;
  EXPECT_EQ(calls_.back().caller, "anna");
}

TEST_F(SecurityTest, CertificatesHaveTheRolesOfTheAccessFile) {
  const auto facts = security::ReadCertificate(
      [&] {
        std::ifstream in(folder_ / "anna.pem");
        return std::string(std::istreambuf_iterator<char>(in), {});
      }(),
      "anna.pem");
  WriteAccess(
      {.tokens = {},
       .certificates = {{.name = "anna", .sha256 = facts->sha256, .roles = {Role::kObserve}}}});
  security::ServerCredentials credentials = Tls();
  credentials.client_ca = Path("ca.pem");
  credentials.access = Path("access.yaml");
  Start({.credentials = credentials});
  const security::ClientCredentials anna = {
      .ca = Path("ca.pem"), .certificate = Path("anna.pem"), .key = Path("anna.key")};
  const auto clients = TryConnect(anna);
  EXPECT_TRUE(clients->recorder->GetStatus().ok());
  const auto refused = clients->recorder->Pause();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kPermissionDenied);
  EXPECT_EQ(refused.error().field, "role");
  EXPECT_THAT(refused.error().message, HasSubstr("takes the role record"));
  EXPECT_EQ(calls_.back().outcome, "permission_denied");

  // The same name in a newer certificate is another one: the file names the old.
  WritePair("anna", authority_, {.organisation = "lab", .name = "anna"});
  EXPECT_THAT(Ask(anna).error().message, HasSubstr("has no access here"));
  EXPECT_EQ(calls_.back().outcome, "unauthenticated");
}

TEST_F(SecurityTest, TokensHaveTheirRolesUntilTheyAreRevoked) {
  const std::string token = security::MakeToken();
  const security::AccessEntry ben = {
      .name = "ben", .sha256 = security::Sha256Hex(token), .roles = {Role::kRecord}};
  WriteAccess({.tokens = {ben}, .certificates = {}});
  Start({.credentials = {.access = Path("access.yaml")}});
  EXPECT_THAT(Ask({}).error().message, HasSubstr("--token"));
  EXPECT_EQ(Ask({}).error().code, ErrorCode::kUnauthenticated);
  EXPECT_EQ(Ask({}).error().field, "token");
  EXPECT_THAT(Ask({.token = "exm_guess"}).error().message, HasSubstr("not known"));

  WriteText("token", token + "\n");
  const auto clients = TryConnect({.token = "@" + Path("token")});
  EXPECT_TRUE(clients->recorder->Pause().ok());
  EXPECT_EQ(calls_.back().caller, "ben");
  EXPECT_EQ(clients->executor->Reset().error().code, ErrorCode::kPermissionDenied);

  WriteAccess({});
  const auto revoked = clients->recorder->Pause();
  ASSERT_FALSE(revoked.ok());
  EXPECT_EQ(calls_.back().outcome, "unauthenticated");
  EXPECT_EQ(revoked.error().message.find(token), std::string::npos);
}

TEST_F(SecurityTest, TokensExpire) {
  const std::string token = security::MakeToken();
  security::AccessEntry ben = {.name = "ben",
                               .sha256 = security::Sha256Hex(token),
                               .roles = {Role::kRecord},
                               .expires = validity_.from};
  WriteAccess({.tokens = {ben}, .certificates = {}});
  Start({.credentials = {.access = Path("access.yaml")}});
  EXPECT_THAT(Ask({.token = token}).error().message, HasSubstr("expired"));
}

TEST_F(SecurityTest, AnAccessFileThatBreaksKeepsItsOldEntriesInForce) {
  const std::string token = security::MakeToken();
  WriteAccess(
      {.tokens = {{.name = "ben", .sha256 = security::Sha256Hex(token), .roles = {Role::kObserve}}},
       .certificates = {}});
  Start({.credentials = {.access = Path("access.yaml")}});
  EXPECT_TRUE(Ask({.token = token}).ok());
  WriteText("access.yaml", "tokens: [oh");
  EXPECT_TRUE(Ask({.token = token}).ok());
  EXPECT_FALSE(Ask({.token = "exm_guess"}).ok());
}

TEST_F(SecurityTest, WhatMovesTheRobotLeavesAnAuditLineEvenWhenRefused) {
  const std::string token = security::MakeToken();
  const std::string observer = security::MakeToken();
  WriteAccess(
      {.tokens = {{.name = "ben", .sha256 = security::Sha256Hex(token), .roles = {Role::kExecute}},
                  {.name = "eve",
                   .sha256 = security::Sha256Hex(observer),
                   .roles = {Role::kObserve}}},
       .certificates = {}});
  Start({.credentials = {.access = Path("access.yaml")}});
  api::ExecuteRequest press;
  press.skill = "press";
  const auto nothing = [](const api::ExecutionFeedback&) {};
  EXPECT_TRUE(TryConnect({.token = token})->executor->Execute(press, nothing, {}).ok());
  const KeptCall done = calls_.back();
  EXPECT_EQ(std::tie(done.caller, done.target, done.outcome, done.audited),
            std::make_tuple("ben", "press", "ok", true));
  EXPECT_THAT(done.request_id, testing::StartsWith("test-"));

  EXPECT_FALSE(TryConnect({.token = observer})->executor->Execute(press, nothing, {}).ok());
  const KeptCall refused = calls_.back();
  EXPECT_EQ(std::tie(refused.caller, refused.target, refused.outcome, refused.audited),
            std::make_tuple("eve", "press", "permission_denied", true));
  // Whoever may look may stop.
  EXPECT_TRUE(TryConnect({.token = observer})->executor->Stop().ok());
}

TEST_F(SecurityTest, CallersWhoCallTooOftenAreHeldBackAloneOfAll) {
  const std::string busy = security::MakeToken();
  const std::string calm = security::MakeToken();
  WriteAccess(
      {.tokens = {{.name = "busy", .sha256 = security::Sha256Hex(busy), .roles = {Role::kObserve}},
                  {.name = "calm", .sha256 = security::Sha256Hex(calm), .roles = {Role::kObserve}}},
       .certificates = {}});
  Start({.credentials = {.access = Path("access.yaml"), .calls_per_s = 0.01}});
  EXPECT_TRUE(Ask({.token = busy}).ok());
  const auto refused = Ask({.token = busy});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kResourceExhausted);
  EXPECT_TRUE(Ask({.token = calm}).ok());
}

TEST_F(SecurityTest, ShortCallsThatTakeTooLongAreCancelled) {
  Start({.max_call = std::chrono::milliseconds(50)});
  {
    const std::lock_guard held(recorder_.hold);
    const auto status = Ask({});
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::kCancelled);
  }
  server_->Shutdown(std::chrono::seconds(20));
  ASSERT_FALSE(calls_.empty());
  EXPECT_EQ(calls_.back().outcome, "deadline_exceeded");
}

TEST_F(SecurityTest, TokensDoNotCrossANetworkInPlainText) {
  const auto clients = Connect({.server = "192.0.2.7:50051", .credentials = {.token = "exm_x"}});
  ASSERT_FALSE(clients.ok());
  EXPECT_THAT(clients.error().message, HasSubstr("plain text"));
}

TEST_F(SecurityTest, ServersBeyondLoopbackRefuseToListenInPlainTextUnlessTold) {
  const auto refused = TryStart({.listen = "0.0.0.0:0"});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("--tls-cert"));
  EXPECT_THAT(refused.error().message, HasSubstr("--insecure-listen"));
  EXPECT_TRUE(TryStart({.listen = "0.0.0.0:0", .credentials = {.insecure_listen = true}}).ok());

  security::ServerCredentials anybody = Tls();
  const auto open = TryStart({.listen = "0.0.0.0:0", .credentials = anybody});
  ASSERT_FALSE(open.ok());
  EXPECT_THAT(open.error().message, HasSubstr("--access"));
  anybody.client_ca = Path("ca.pem");
  EXPECT_TRUE(TryStart({.listen = "0.0.0.0:0", .credentials = anybody}).ok());
}

TEST_F(SecurityTest, FilesThatDoNotFitTogetherAreNamed) {
  security::ServerCredentials mixed = Tls();
  mixed.key = Path("anna.key");
  EXPECT_THAT(TryStart({.credentials = mixed}).error().message, HasSubstr("is not the key of"));
  mixed.key = "";
  EXPECT_THAT(TryStart({.credentials = mixed}).error().message, HasSubstr("together"));
  mixed.key = Path("none.key");
  EXPECT_THAT(TryStart({.credentials = mixed}).error().message, HasSubstr("none.key"));
  EXPECT_THAT(TryStart({.credentials = {.access = Path("none.yaml")}}).error().message,
              HasSubstr("none.yaml"));
}

}  // namespace
}  // namespace exemplar::rpc
