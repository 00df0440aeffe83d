// The gateway's door before a real HTTP server.

#include "gateway/door.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "exemplar/security/digest.hpp"
#include "unit/http/raw_client.hpp"

namespace exemplar::gateway {
namespace {

using http::testing::Reply;
using security::Role;
using ::testing::HasSubstr;
using ::testing::Not;

class DoorTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "exemplar-door-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    Allow({{.name = "anna", .sha256 = security::Sha256Hex("secret"), .roles = {Role::kTeach}},
           {.name = "nobody", .sha256 = security::Sha256Hex("empty")}});
    auto door = Door::Open((folder_ / "access.yaml").string(), clock_, log_);
    ASSERT_TRUE(door.ok()) << door.error().message;
    door_ = std::move(*door);
    server_ = *http::Server::Create(
        {.gate = [this](http::Request& request) { return door_->Judge(request); }}, log_);
    ASSERT_TRUE(door_->AddRoutes(*server_).ok());
    const auto echo = [](const http::Request& request) {
      return http::Answer(request.identity + " " + request.headers.Get("Authorization"));
    };
    ASSERT_TRUE(server_->Route(http::Method::kGet, "/thing", echo).ok());
    ASSERT_TRUE(server_->Route(http::Method::kPost, "/thing", echo).ok());
    server_->Start();
  }
  void TearDown() override {
    server_.reset();
    std::filesystem::remove_all(folder_);
  }

  void Allow(std::vector<security::AccessEntry> tokens) const {
    const Status written = security::WriteAccessList(
        folder_ / "access.yaml", {.tokens = std::move(tokens), .certificates = {}});
    ASSERT_TRUE(written.ok()) << written.error().message;
  }

  Reply Ask(const std::string& line, const std::string& fields = {},
            const std::string& body = {}) const {
    return http::testing::Ask(server_->port(), line, fields, body);
  }

  struct Login {
    std::string cookie;  ///< as a header line
    std::string csrf;    ///< likewise
  };
  Login LogIn() {
    const Reply reply =
        Ask("POST /login", "Content-Type: application/json\r\n", R"({"token":"secret"})");
    EXPECT_EQ(reply.status, 200) << reply.body;
    const std::size_t begin = reply.head.find("exemplar=");
    const std::string cookie = reply.head.substr(begin, reply.head.find(';', begin) - begin);
    const std::string csrf = nlohmann::json::parse(reply.body)["csrf"];
    return {"Cookie: " + cookie + "\r\n", "X-CSRF-Token: " + csrf + "\r\n"};
  }

  NullLog log_;
  SystemClock clock_;
  std::filesystem::path folder_;
  std::unique_ptr<Door> door_;
  std::unique_ptr<http::Server> server_;
};

TEST_F(DoorTest, ProgramsShowATokenWithEachRequest) {
  const Reply good = Ask("POST /thing", "Authorization: Bearer secret\r\n");
  EXPECT_EQ(good.status, 200);
  EXPECT_EQ(good.body, "anna Bearer secret");
  EXPECT_EQ(Ask("GET /thing").status, 401);
  EXPECT_THAT(Ask("GET /thing").head, HasSubstr("WWW-Authenticate: Bearer"));
  EXPECT_EQ(Ask("GET /thing", "Authorization: Bearer wrong\r\n").status, 401);
  EXPECT_EQ(Ask("GET /thing?token=secret").status, 401) << "in an address, for WebSockets only";
}

TEST_F(DoorTest, WhoHasNoRoleStaysOutside) {
  EXPECT_EQ(Ask("GET /thing", "Authorization: Bearer empty\r\n").status, 403);
}

TEST_F(DoorTest, BrowsersAreLedToTheLogin) {
  const Reply reply = Ask("GET /thing", "Accept: text/html\r\n");
  EXPECT_EQ(reply.status, 303);
  EXPECT_THAT(reply.head, HasSubstr("Location: /login"));
  const Reply page = Ask("GET /login");
  EXPECT_EQ(page.status, 200);
  EXPECT_THAT(page.head, HasSubstr("Content-Security-Policy: default-src 'none'"));
  EXPECT_THAT(page.head, HasSubstr("frame-ancestors 'none'"));
  EXPECT_THAT(page.head, Not(HasSubstr("unsafe-inline")));
  EXPECT_THAT(Ask("GET /login.css").head, HasSubstr("Content-Type: text/css"));
}

TEST_F(DoorTest, ALoginIsACookieThatNoScriptReadsAndNoOtherSiteSends) {
  const Reply reply =
      Ask("POST /login", "Content-Type: application/x-www-form-urlencoded\r\n", "token=sec%72et");
  EXPECT_EQ(reply.status, 303);
  EXPECT_THAT(reply.head, HasSubstr("; HttpOnly; SameSite=Strict"));
  EXPECT_THAT(reply.head, HasSubstr("Cache-Control: no-store"));
  const Login login = LogIn();
  EXPECT_EQ(Ask("GET /thing", login.cookie).body, "anna Bearer secret");
  EXPECT_THAT(Ask("GET /session", login.cookie).body, HasSubstr("\"csrf\""));
}

TEST_F(DoorTest, WhatChangesSomethingNeedsTheTokenOfOurPageBesideTheCookie) {
  const Login login = LogIn();
  EXPECT_EQ(Ask("POST /thing", login.cookie).status, 403);
  EXPECT_EQ(Ask("POST /thing", login.cookie + "X-CSRF-Token: guess\r\n").status, 403);
  EXPECT_EQ(Ask("POST /thing", login.cookie + LogIn().csrf).status, 403) << "of another session";
  EXPECT_EQ(Ask("POST /thing", login.cookie + login.csrf).status, 200);
}

TEST_F(DoorTest, SessionsEndWithTheLogoutAndWithTheToken) {
  const Login first = LogIn();
  EXPECT_EQ(Ask("POST /logout", first.cookie + first.csrf).status, 200);
  EXPECT_EQ(Ask("GET /thing", first.cookie).status, 401);
  const Login second = LogIn();
  EXPECT_EQ(Ask("GET /thing", second.cookie).status, 200);
  Allow({});
  EXPECT_EQ(Ask("GET /thing", second.cookie).status, 401);
}

TEST_F(DoorTest, LoginsThatFailAreHeldBack) {
  int refused = 0;
  for (int i = 0; i < 10; ++i) {
    const Reply reply =
        Ask("POST /login", "Content-Type: application/json\r\n", R"({"token":"guess"})");
    refused += reply.status == 429 ? 1 : 0;
    EXPECT_THAT(reply.head, Not(HasSubstr("Set-Cookie")));
  }
  EXPECT_GT(refused, 0);
  for (const char* body : {"", "[]", "{\"token\":3}", "{"}) {
    EXPECT_THAT(Ask("POST /login", "Content-Type: application/json\r\n", body).status,
                ::testing::AnyOf(401, 429));
  }
}

}  // namespace
}  // namespace exemplar::gateway
