#include <gtest/gtest.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

#include "../../support/eventually.hpp"
#include "raw_client.hpp"
#include "server_fixture.hpp"

namespace exemplar::http {
namespace {

using exemplar::testing::Eventually;
using std::chrono::milliseconds;
using testing::RawClient;

constexpr const char* kGet = "GET /hello HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";

TEST_F(ServerTest, AnswersOneRequestAfterTheOtherOnAConnection) {
  Make();
  ASSERT_TRUE(server_
                  ->Route(Method::kPost, "/echo/{name}",
                          [](const Request& request) {
                            return Answer(request.variables.at("name") + " " + request.peer + " " +
                                          request.body);
                          })
                  .ok());
  server_->Start();
  RawClient client(port());
  for (int i = 0; i < 3; ++i) {
    client.Send(kGet);
    const std::string answer = client.ReadAnswer();
    EXPECT_NE(answer.find("200 OK"), std::string::npos) << answer;
    EXPECT_NE(answer.find("\r\n\r\nhello\n"), std::string::npos) << answer;
  }
  client.Send("POST /echo/a%20b HTTP/1.1\r\nHost: x\r\nContent-Length: 4\r\n\r\nbody");
  EXPECT_NE(client.ReadAnswer().find("a b 127.0.0.1 body"), std::string::npos);
  EXPECT_EQ(Count(&Counters::accepted), 1U);
  EXPECT_EQ(Count(&Counters::requests), 4U);
}

TEST_F(ServerTest, AnswersRequestsThatWereSentAhead) {
  Make();
  server_->Start();
  RawClient client(port());
  client.Send(std::string(kGet) + kGet + kGet);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NE(client.ReadAnswer().find("\r\n\r\nhello\n"), std::string::npos) << i;
  }
}

TEST_F(ServerTest, AnswersHeadWithoutBodyAndClosesForHttp10) {
  Make();
  server_->Start();
  RawClient client(port());
  client.Send("HEAD /hello HTTP/1.0\r\n\r\n");
  const std::string answer = client.ReadAll();
  EXPECT_NE(answer.find("Content-Length: 6\r\n"), std::string::npos) << answer;
  EXPECT_TRUE(answer.ends_with("\r\n\r\n")) << answer;
}

TEST_F(ServerTest, SaysWhatIsWrongWithARequest) {
  ServerOptions options;
  options.limits.body_bytes = 10;
  options.limits.header_bytes = 1000;
  Make(options);
  ASSERT_TRUE(
      server_->Route(Method::kPost, "/body", [](const Request&) { return Answer("x"); }, {}).ok());
  server_->Start();
  const std::pair<std::string, std::string> cases[] = {
      {"GET /none HTTP/1.1\r\n\r\n", "404"},
      {"DELETE /hello HTTP/1.1\r\n\r\n", "405"},
      {"BREW /hello HTTP/1.1\r\n\r\n", "501"},
      {"GET /%zz HTTP/1.1\r\n\r\n", "400"},
      {"GET /../hello HTTP/1.1\r\n\r\n", "400"},
      {"\x16\x03\x01\x02\x00\x01\x00\x01\r\n\r\n", "400"},
      {"GET /hello HTTP/1.1\r\nX: " + std::string(2000, 'x') + "\r\n\r\n", "431"},
      {"POST /body HTTP/1.1\r\nContent-Length: 11\r\n\r\nhello world", "413"},
      {"POST /body HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nb\r\nhello world\r\n0\r\n\r\n",
       "413"},
      {"POST /body HTTP/1.1\r\nContent-Length: 99999999999999999999999\r\n\r\n", "400"},
      {"POST /body HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n", "400"},
  };
  for (const auto& [request, status] : cases) {
    RawClient client(port());
    client.Send(request);
    EXPECT_EQ(client.ReadAnswer().substr(9, 3), status) << request.substr(0, 60);
  }
  RawClient client(port());
  client.Send(kGet);
  EXPECT_EQ(client.ReadAnswer().substr(9, 3), "200");
}

TEST_F(ServerTest, TellsTheClientToGoOnWithABodyThatItMaySend) {
  Make();
  ASSERT_TRUE(server_
                  ->Route(Method::kPost, "/body",
                          [](const Request& request) { return Answer(request.body); })
                  .ok());
  server_->Start();
  RawClient client(port());
  client.Send("POST /body HTTP/1.1\r\nContent-Length: 4\r\nExpect: 100-continue\r\n\r\n");
  EXPECT_EQ(client.ReadTo("\r\n\r\n"), "HTTP/1.1 100 Continue\r\n\r\n");
  client.Send("body");
  EXPECT_TRUE(client.ReadAnswer().ends_with("body"));
}

TEST_F(ServerTest, CutsAClientThatSendsAByteNowAndThen) {
  ServerOptions options;
  options.limits.request_timeout = std::chrono::seconds(2);  // fast even on a busy machine
  Make(options);
  server_->Start();
  RawClient slow(port());
  RawClient silent(port());
  RawClient fast(port());
  slow.Send("GET /hello HT");
  fast.Send(kGet);
  EXPECT_EQ(fast.ReadAnswer().substr(9, 3), "200");
  EXPECT_TRUE(slow.Closed());
  EXPECT_TRUE(silent.Closed());
  EXPECT_EQ(Count(&Counters::timeouts), 2U);
}

TEST_F(ServerTest, RefusesMoreConnectionsThanAllowedAndServesTheOthersOn) {
  ServerOptions options;
  options.limits.connections = 2;
  Make(options);
  server_->Start();
  RawClient first(port());
  RawClient second(port());
  first.Send(kGet);
  second.Send(kGet);
  EXPECT_EQ(first.ReadAnswer().substr(9, 3), "200");
  EXPECT_EQ(second.ReadAnswer().substr(9, 3), "200");
  RawClient third(port());
  EXPECT_TRUE(third.Closed());
  first.Send(kGet);
  EXPECT_EQ(first.ReadAnswer().substr(9, 3), "200");
  EXPECT_EQ(Count(&Counters::refused_connections), 1U);
}

TEST_F(ServerTest, RefusesAFloodOfConnectionsWhileOthersAreServed) {
  ServerOptions options;
  options.limits.accepts_per_second_per_peer = 50;
  Make(options);
  server_->Start();
  RawClient calm(port());
  constexpr int kFlood = 1000;
  for (int i = 0; i < kFlood; ++i) {
    RawClient hasty(port(), 0, 2);
    if (i % 100 == 0) {
      calm.Send(kGet);
      EXPECT_EQ(calm.ReadAnswer().substr(9, 3), "200");
    }
  }
  RawClient another(port());
  another.Send(kGet);
  EXPECT_EQ(another.ReadAnswer().substr(9, 3), "200");
  EXPECT_TRUE(Eventually([&] {
    return Count(&Counters::refused_connections) + Count(&Counters::accepted) >= kFlood + 2;
  }));
  EXPECT_GT(Count(&Counters::refused_connections), 0U);
  EXPECT_TRUE(Eventually([&] { return server_->connections() <= 2; }));
}

TEST_F(ServerTest, StreamsAnAnswerNoFasterThanTheClientTakesIt) {
  ServerOptions options;
  options.limits.stream_bytes = 64 << 10;
  Make(options);
  std::atomic<std::size_t> written{0};
  constexpr std::size_t kPieces = 2000;
  const std::string piece(16 << 10, 'p');
  ASSERT_TRUE(server_
                  ->RouteStream(Method::kGet, "/stream",
                                [&](const Request&, Stream& stream) {
                                  stream.Begin(200, {{"Content-Type", "text/plain"}});
                                  for (std::size_t i = 0; i < kPieces && stream.Write(piece); ++i)
                                    ++written;
                                })
                  .ok());
  server_->Start();
  RawClient client(port(), 16 << 10);
  client.Send("GET /stream HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  EXPECT_NE(client.ReadTo("\r\n\r\n").find("Transfer-Encoding: chunked"), std::string::npos);
  EXPECT_TRUE(Eventually([&] { return written > 4; }));
  EXPECT_LT(written, kPieces);
  const std::string all = client.ReadAll();
  EXPECT_EQ(std::count(all.begin(), all.end(), 'p'),
            static_cast<std::ptrdiff_t>(kPieces * piece.size()));
  EXPECT_TRUE(all.ends_with("\r\n0\r\n\r\n"));
}

TEST_F(ServerTest, TellsAHandlerThatItsClientHasGone) {
  Make();
  std::atomic<bool> told{false};
  ASSERT_TRUE(server_
                  ->RouteStream(Method::kGet, "/stream",
                                [&](const Request& request, Stream& stream) {
                                  stream.Begin(200, {});
                                  std::mutex mutex;
                                  std::condition_variable_any gone;
                                  std::unique_lock lock(mutex);
                                  gone.wait(lock, request.gone, [] { return false; });
                                  told = true;
                                })
                  .ok());
  server_->Start();
  {
    RawClient client(port());
    client.Send("GET /stream HTTP/1.1\r\nHost: x\r\n\r\n");
    client.ReadTo("\r\n\r\n");
  }
  EXPECT_TRUE(Eventually([&] { return told.load(); }));
}

TEST_F(ServerTest, AnswersQuickRoutesWhileAllHandlersAreBusy) {
  ServerOptions options;
  options.limits.handlers = 2;
  options.limits.waiting_requests = 1;
  Make(options);
  std::mutex mutex;
  std::condition_variable_any changed;
  bool go = false;
  std::atomic<int> running{0};
  ASSERT_TRUE(server_
                  ->Route(Method::kGet, "/slow",
                          [&](const Request& request) {
                            ++running;
                            std::unique_lock lock(mutex);
                            changed.wait(lock, request.gone, [&] { return go; });
                            return Answer("slow");
                          })
                  .ok());
  ASSERT_TRUE(server_
                  ->Route(Method::kGet, "/healthz", [](const Request&) { return Answer("ok"); },
                          {.quick = true})
                  .ok());
  server_->Start();
  std::deque<RawClient> slow;
  for (int i = 0; i < 3; ++i) {
    slow.emplace_back(port()).Send("GET /slow HTTP/1.1\r\nHost: x\r\n\r\n");
    if (i < 2) {
      EXPECT_TRUE(Eventually([&] { return running == i + 1; }));
    }
  }
  EXPECT_TRUE(Eventually([&] { return Count(&Counters::requests) == 3; }));
  RawClient refused(port());
  refused.Send("GET /slow HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(refused.ReadAnswer().substr(9, 3), "503");
  RawClient quick(port());
  quick.Send("GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(quick.ReadAnswer().substr(9, 3), "200");
  {
    const std::lock_guard lock(mutex);
    go = true;
  }
  changed.notify_all();
  for (RawClient& client : slow) EXPECT_EQ(client.ReadAnswer().substr(9, 3), "200");
}

TEST_F(ServerTest, TurnsAHandlersExceptionIntoA500) {
  Make();
  ASSERT_TRUE(server_
                  ->Route(Method::kGet, "/bad",
                          [](const Request&) -> Response { throw std::runtime_error("no"); })
                  .ok());
  server_->Start();
  RawClient client(port());
  client.Send("GET /bad HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(client.ReadAnswer().substr(9, 3), "500");
  EXPECT_EQ(Count(&Counters::handler_failures), 1U);
}

TEST_F(ServerTest, AsksTheGateBeforeItReadsABody) {
  ServerOptions options;
  options.gate = [](Request& request) -> std::optional<Response> {
    if (request.headers.Get("Authorization") != "Bearer good") return Response{401, {}, "who?"};
    request.identity = "alice";
    return std::nullopt;
  };
  Make(options);
  ASSERT_TRUE(server_
                  ->Route(Method::kPost, "/who",
                          [](const Request& request) { return Answer(request.identity); })
                  .ok());
  ASSERT_TRUE(
      server_
          ->Route(Method::kGet, "/open", [](const Request&) { return Answer("x"); }, {.open = true})
          .ok());
  server_->Start();
  RawClient stranger(port());
  stranger.Send("POST /who HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n");
  EXPECT_EQ(stranger.ReadAnswer().substr(9, 3), "401");
  RawClient open(port());
  open.Send("GET /open HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(open.ReadAnswer().substr(9, 3), "200");
  RawClient friendly(port());
  friendly.Send(
      "POST /who HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer good\r\n"
      "Content-Length: 0\r\n\r\n");
  EXPECT_TRUE(friendly.ReadAnswer().ends_with("alice"));
}

TEST_F(ServerTest, LetsOnlyListedPagesUseIt) {
  ServerOptions options;
  options.origins.allowed = {"https://good.example"};
  Make(options);
  server_->Start();
  RawClient client(port());
  client.Send("GET /hello HTTP/1.1\r\nHost: robot\r\nOrigin: https://good.example\r\n\r\n");
  EXPECT_NE(client.ReadAnswer().find("Access-Control-Allow-Origin: https://good.example\r\n"),
            std::string::npos);
  client.Send("OPTIONS /hello HTTP/1.1\r\nHost: robot\r\nOrigin: https://good.example\r\n\r\n");
  const std::string preflight = client.ReadAnswer();
  EXPECT_EQ(preflight.substr(9, 3), "204") << preflight;
  EXPECT_NE(preflight.find("Access-Control-Allow-Methods: GET, HEAD\r\n"), std::string::npos);
  client.Send("GET /hello HTTP/1.1\r\nHost: robot\r\nOrigin: https://bad.example\r\n\r\n");
  EXPECT_EQ(client.ReadAnswer().substr(9, 3), "403");
  EXPECT_EQ(Count(&Counters::refused_origins), 1U);
}

TEST_F(ServerTest, StopsWhileAHandlerWaits) {
  Make();
  std::atomic<bool> runs{false};
  ASSERT_TRUE(server_
                  ->Route(Method::kGet, "/wait",
                          [&](const Request& request) {
                            runs = true;
                            std::mutex mutex;
                            std::condition_variable_any gone;
                            std::unique_lock lock(mutex);
                            gone.wait(lock, request.gone, [] { return false; });
                            return Answer("ended");
                          })
                  .ok());
  server_->Start();
  RawClient client(port());
  client.Send("GET /wait HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_TRUE(Eventually([&] { return runs.load(); }));
  server_->Stop();
  EXPECT_TRUE(client.ReadAnswer().ends_with("ended"));
  EXPECT_FALSE(RawClient(port()).connected());
}

TEST_F(ServerTest, NamesWhatItCannotListenOn) {
  Make();
  ServerOptions taken;
  taken.listen = "127.0.0.1:" + std::to_string(port());
  EXPECT_EQ(Server::Create(taken, log_).error().code, ErrorCode::kUnavailable);
  for (const char* bad : {"", "localhost", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:99999"}) {
    ServerOptions options;
    options.listen = bad;
    const auto made = Server::Create(options, log_);
    ASSERT_FALSE(made.ok()) << bad;
    EXPECT_EQ(made.error().code, ErrorCode::kInvalidArgument) << bad;
  }
  EXPECT_FALSE(server_->Route(Method::kGet, "/hello", nullptr).ok());
}

}  // namespace
}  // namespace exemplar::http
