#include <gtest/gtest.h>

#include <atomic>
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

/// Sends back what it gets.
class Echo final : public WebSocketSession {
 public:
  Echo(std::shared_ptr<WebSocket> socket, std::atomic<int>& closed)
      : socket_(std::move(socket)), closed_(closed) {}
  void OnText(std::string_view text) override { socket_->SendText(std::string(text)); }
  void OnBinary(std::span<const std::byte> bytes) override {
    Frame frame{.binary = true};
    frame.head.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    socket_->Send(std::move(frame));
  }
  void OnClose() override { ++closed_; }

 private:
  std::shared_ptr<WebSocket> socket_;
  std::atomic<int>& closed_;
};

class WebSocketTest : public ServerTest {
 protected:
  void MakeEcho(ServerOptions options = {}, WebSocketEndpoint endpoint = {},
                const std::function<void()>& more = {}) {
    Make(std::move(options));
    endpoint.open = [this](std::shared_ptr<WebSocket> socket) {
      const std::lock_guard lock(mutex_);
      sockets_.push_back(socket);
      return std::make_unique<Echo>(std::move(socket), closed_);
    };
    ASSERT_TRUE(server_->RouteWebSocket("/ws", std::move(endpoint)).ok());
    if (more) more();
    server_->Start();
  }
  std::shared_ptr<WebSocket> Socket(std::size_t i) {
    EXPECT_TRUE(Eventually([&] {
      const std::lock_guard lock(mutex_);
      return sockets_.size() > i;
    }));
    const std::lock_guard lock(mutex_);
    return sockets_.at(i);
  }

  std::mutex mutex_;
  std::vector<std::shared_ptr<WebSocket>> sockets_;
  std::atomic<int> closed_{0};
};

TEST_F(WebSocketTest, CarriesTextAndBinaryMessages) {
  MakeEcho({}, {.subprotocols = {"b.v1", "a.v1"}});
  RawClient client(port());
  const std::string answer = client.Upgrade("/ws", "Sec-WebSocket-Protocol: x, a.v1,b.v1\r\n");
  EXPECT_EQ(answer.substr(9, 3), "101") << answer;
  EXPECT_NE(answer.find("Sec-WebSocket-Protocol: b.v1\r\n"), std::string::npos) << answer;
  client.SendFrame(0x81, "hello");
  EXPECT_EQ(client.ReadFrame().payload, "hello");
  const std::string large(100'000, 'b');
  client.SendFrame(0x82, large);
  const auto frame = client.ReadFrame();
  EXPECT_EQ(frame.first, 0x82);
  EXPECT_EQ(frame.payload, large);
  client.SendFrame(0x89, "ping");
  EXPECT_EQ(client.ReadFrame().first, 0x8a);
  EXPECT_EQ(Socket(0)->subprotocol(), "b.v1");
  client.SendFrame(0x88, "\x03\xe8");
  EXPECT_EQ(client.ReadFrame().first, 0x88);
  client.SendNoMore();
  EXPECT_TRUE(Eventually([&] { return closed_ == 1; }));
  EXPECT_FALSE(Socket(0)->SendText("late").open);
}

TEST_F(WebSocketTest, APathMayHaveAPageBesideItsEndpoint) {
  MakeEcho({}, {.subprotocols = {"a.v1"}}, [this] {
    const auto page = [](const Request&) { return Answer("page"); };
    EXPECT_TRUE(server_->Route(Method::kGet, "/ws", page).ok());
    EXPECT_FALSE(server_->Route(Method::kGet, "/ws", page).ok());
  });
  RawClient browser(port());
  browser.Send("GET /ws HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_TRUE(browser.ReadAnswer().ends_with("page"));
  EXPECT_EQ(RawClient(port()).Upgrade("/ws", "Sec-WebSocket-Protocol: a.v1\r\n").substr(9, 3),
            "101");
}

TEST_F(WebSocketTest, RefusesWhoOffersNoSubprotocolOrComesFromAnotherPage) {
  MakeEcho({}, {.subprotocols = {"a.v1"}});
  EXPECT_EQ(RawClient(port()).Upgrade("/ws").substr(9, 3), "400");
  EXPECT_EQ(RawClient(port()).Upgrade("/ws", "Sec-WebSocket-Protocol: b\r\n").substr(9, 3), "400");
  EXPECT_EQ(RawClient(port())
                .Upgrade("/ws", "Sec-WebSocket-Protocol: a.v1\r\nOrigin: http://evil\r\n")
                .substr(9, 3),
            "403");
  EXPECT_EQ(RawClient(port()).Upgrade("/hello").substr(9, 3), "200");
  RawClient plain(port());
  plain.Send("GET /ws HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(plain.ReadAnswer().substr(9, 3), "426");
  EXPECT_EQ(Count(&Counters::websockets), 0U);
}

TEST_F(WebSocketTest, ClosesForBadFramesAndServesTheOthersOn) {
  MakeEcho({}, {.message_bytes = 1000});
  RawClient good(port());
  good.Upgrade("/ws");
  const std::string bad[] = {
      std::string("\x81\x05hello", 7),             // not masked
      std::string("\x83\x80\0\0\0\0", 6),          // an opcode that is none
      std::string("\xf1\x80\0\0\0\0", 6),          // reserved bits
      std::string("\x80\x80\0\0\0\0", 6),          // continues nothing
      std::string("\x81\x82\0\0\0\0\xff\xfe", 8),  // text that is not UTF-8
      std::string("\x82\xff\x7f\xff\xff\xff\xff\xff\xff\xff\0\0\0\0", 14),  // too long
      std::string("\x89\xfe\x01\x00\0\0\0\0", 8),  // a ping that is too long
  };
  std::uint64_t count = 0;
  for (const std::string& bytes : bad) {
    {
      RawClient client(port());
      client.Upgrade("/ws");
      client.Send(bytes);
      EXPECT_TRUE(client.Closed()) << count;
    }
    ++count;
    EXPECT_TRUE(Eventually([&] { return Count(&Counters::bad_frames) == count; })) << count;
  }
  RawClient client(port());
  client.Upgrade("/ws");
  client.SendFrame(0x81, std::string(1001, 'x'));
  EXPECT_TRUE(client.Closed());
  good.SendFrame(0x81, "still here");
  EXPECT_EQ(good.ReadFrame().payload, "still here");
}

TEST_F(WebSocketTest, DropsTheOldestForAClientThatReadsNothingAndCountsIt) {
  WebSocketEndpoint endpoint;
  endpoint.queue_bytes = 100'000;
  MakeEcho({}, std::move(endpoint));
  RawClient stalled(port(), 4096);
  stalled.Upgrade("/ws");
  RawClient good(port());
  good.Upgrade("/ws");
  const auto slow_socket = Socket(0);
  const auto good_socket = Socket(1);
  const auto body = std::make_shared<const std::vector<std::byte>>(10'000);
  std::uint64_t dropped = 0;
  constexpr std::uint64_t kFrames = 2000;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    const Frame frame{.binary = true,
                      .head = std::to_string(i),
                      .body = *body,
                      .owner = body,
                      .droppable = true,
                      .tag = i};
    for (const std::uint64_t tag : slow_socket->Send(frame).dropped) {
      EXPECT_LE(tag, i);
      ++dropped;
    }
    ASSERT_TRUE(good_socket->Send(frame).open);
    ASSERT_EQ(good.ReadFrame().payload.size(), frame.head.size() + body->size());
  }
  EXPECT_GT(dropped, 1000U);
  EXPECT_EQ(slow_socket->dropped(), dropped);
  EXPECT_EQ(good_socket->dropped(), 0U);
  EXPECT_LE(slow_socket->queued_bytes(), 100'000U);
  EXPECT_EQ(Count(&Counters::frames_dropped), dropped);
}

TEST_F(WebSocketTest, ClosesAClientThatIsTooFarBehindForWhatMustNotBeDropped) {
  WebSocketEndpoint endpoint;
  endpoint.firm_bytes = 100'000;
  ServerOptions options;
  options.limits.request_timeout = std::chrono::seconds(2);  // for the answer to the close as well
  MakeEcho(std::move(options), std::move(endpoint));
  RawClient stalled(port(), 4096);
  stalled.Upgrade("/ws");
  const auto socket = Socket(0);
  EXPECT_TRUE(Eventually([&] { return !socket->SendText(std::string(10'000, 'x')).open; }));
  std::string all = stalled.ReadAll();
  EXPECT_NE(all.find("too far behind"), std::string::npos);
}

TEST_F(WebSocketTest, PingsAndThenCutsAClientThatHasFallenSilent) {
  WebSocketEndpoint endpoint;
  endpoint.silence = milliseconds(200);
  MakeEcho({}, std::move(endpoint));
  RawClient client(port());
  client.Upgrade("/ws");
  EXPECT_EQ(client.ReadFrame().first, 0x89);
  EXPECT_TRUE(client.Closed());
  EXPECT_TRUE(Eventually([&] { return closed_ == 1; }));
  EXPECT_EQ(Count(&Counters::timeouts), 1U);
}

TEST_F(WebSocketTest, BoundsTheClientsOfAnEndpoint) {
  WebSocketEndpoint endpoint;
  endpoint.clients = 1;
  MakeEcho({}, std::move(endpoint));
  auto first = std::make_unique<RawClient>(port());
  EXPECT_EQ(first->Upgrade("/ws").substr(9, 3), "101");
  EXPECT_EQ(RawClient(port()).Upgrade("/ws").substr(9, 3), "503");
  first.reset();
  EXPECT_TRUE(Eventually([&] { return closed_ == 1; }));
  EXPECT_TRUE(Eventually([&] { return RawClient(port()).Upgrade("/ws").substr(9, 3) == "101"; }));
}

TEST_F(WebSocketTest, SaysGoodbyeWhenTheServerStopsAndOutlivesIt) {
  ServerOptions options;
  options.grace = milliseconds(200);
  MakeEcho(std::move(options));
  RawClient client(port());
  client.Upgrade("/ws");
  const auto socket = Socket(0);
  std::thread stop([&] { server_.reset(); });
  const auto frame = client.ReadFrame();
  EXPECT_EQ(frame.first, 0x88);
  EXPECT_EQ(frame.payload.substr(0, 2), std::string("\x03\xe9"));
  client.SendFrame(0x88, "\x03\xe9");
  stop.join();
  EXPECT_EQ(closed_, 1);
  EXPECT_FALSE(socket->SendText("late").open);
}

}  // namespace
}  // namespace exemplar::http
