#include "gateway/foxglove/playback.hpp"

#include <gmock/gmock.h>
#include <stdlib.h>

#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "exemplar/recording/file.hpp"
#include "exemplar/recording/writer.hpp"
#include "gateway/foxglove/protocol.hpp"
#include "unit/http/raw_client.hpp"

namespace exemplar::gateway::foxglove {
namespace {

using http::testing::RawClient;
using Json = nlohmann::json;

constexpr std::int64_t kBegin = 1'600'000'000'000'000'000;
constexpr std::int64_t kStep = 10'000'000;
constexpr int kMessages = 31;
constexpr const char* kIdl = "module lab { struct Reading { unsigned long long seq; }; };";

class PlaybackTest : public ::testing::Test {
 protected:
  void SetUp() override {
    char folder[] = "/tmp/exemplar-playback-XXXXXX";
    folder_ = mkdtemp(folder);
    auto sink = recording::FileSink::Create(folder_ / "trial.mcap");
    ASSERT_TRUE(sink.ok());
    auto writer = recording::Writer::Create(**sink);
    const std::string idl = kIdl;
    ASSERT_TRUE((*writer)->AddSchema({1, "lab::Reading", "omgidl", {idl.begin(), idl.end()}}).ok());
    ASSERT_TRUE((*writer)->AddChannel({1, 1, "reading", "cdr", {{"type", "lab::Reading"}}}).ok());
    for (int i = 0; i < kMessages; ++i) {
      const recording::Bytes cdr = {0, 1, 0, 0, static_cast<std::uint8_t>(i), 0, 0, 0, 0, 0, 0, 0};
      const Stamp at = Stamp::FromNanoseconds(kBegin + i * kStep);
      ASSERT_TRUE((*writer)
                      ->Write(recording::MessageView{1, static_cast<std::uint32_t>(i), at, at, cdr})
                      .ok());
    }
    ASSERT_TRUE((*writer)->Close().ok());
    playback_ = Playback::Create(clock_, log_, {.folder = folder_});
    auto server = http::Server::Create({}, log_);
    ASSERT_TRUE(server.ok());
    server_ = std::move(*server);
    ASSERT_TRUE(server_->RouteWebSocket("/recordings/{file}", playback_->Endpoint()).ok());
    server_->Start();
  }
  void TearDown() override {
    server_.reset();
    playback_.reset();
    std::filesystem::remove_all(folder_);
  }

  SystemClock clock_;
  NullLog log_;
  std::filesystem::path folder_;
  std::unique_ptr<Playback> playback_;
  std::unique_ptr<http::Server> server_;
};

class Viewer {
 public:
  Viewer(int port, const std::string& file, const std::string& subprotocol) : socket_(port) {
    answer =
        socket_.Upgrade("/recordings/" + file, "Sec-WebSocket-Protocol: " + subprotocol + "\r\n");
  }
  Json Await(const std::string& op) {
    while (true) {
      const RawClient::Frame frame = socket_.ReadFrame();
      if (frame.first < 0) return {};
      if (frame.first != 0x81) continue;
      Json json = Json::parse(frame.payload);
      if (json["op"] == op) return json;
    }
  }
  std::string AwaitBytes(char opcode) {
    while (true) {
      const RawClient::Frame frame = socket_.ReadFrame();
      if (frame.first < 0) return {};
      if (frame.first == 0x82 && frame.payload.at(0) == opcode) return frame.payload;
    }
  }
  void Subscribe() {
    Await("advertise");
    socket_.SendFrame(0x81, R"({"op":"subscribe","subscriptions":[{"id":4,"channelId":1}]})");
  }
  void Control(bool play, float speed, std::optional<std::int64_t> seek, const std::string& id) {
    std::string bytes = {'\x03', play ? '\0' : '\1'};
    const auto put = [&](const auto& number) {
      bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
    };
    put(speed);
    put(static_cast<std::uint8_t>(seek ? 1 : 0));
    put(seek.value_or(0));
    put(static_cast<std::uint32_t>(id.size()));
    socket_.SendFrame(0x82, bytes + id);
  }
  struct State {
    int status = -1;
    std::int64_t time = 0;
    bool sought = false;
    std::string id;
  };
  State AwaitState(const std::string& id) {
    while (true) {
      const std::string bytes = AwaitBytes('\x05');
      if (bytes.size() < 19) return {};
      State state{bytes[1], 0, bytes[14] != 0, bytes.substr(19)};
      std::memcpy(&state.time, bytes.data() + 2, 8);
      if (state.id == id) return state;
    }
  }
  /// The number that the next message holds.
  int AwaitReading() {
    const std::string bytes = AwaitBytes('\x01');
    return bytes.size() < 25 ? -1 : bytes[17];
  }

  std::string answer;

 private:
  RawClient socket_;
};

TEST_F(PlaybackTest, BeginsPausedAndPlaysFromWhereTheClientWants) {
  Viewer viewer(server_->port(), "trial.mcap", kSdkV1);
  const Json info = viewer.Await("serverInfo");
  EXPECT_EQ(info["capabilities"], (Json{"time", "playbackControl"}));
  EXPECT_EQ(info["dataStartTime"], (Json{{"sec", 1'600'000'000}, {"nsec", 0}}));
  EXPECT_EQ(info["dataEndTime"], (Json{{"sec", 1'600'000'000}, {"nsec", 300'000'000}}));
  viewer.Subscribe();
  EXPECT_EQ(viewer.AwaitState("").status, 1);
  viewer.Control(false, 2, kBegin + 20 * kStep, "seek");
  const Viewer::State sought = viewer.AwaitState("seek");
  EXPECT_EQ(sought.status, 1);
  EXPECT_TRUE(sought.sought);
  EXPECT_EQ(sought.time, kBegin + 20 * kStep);
  viewer.Control(true, 2, std::nullopt, "play");
  EXPECT_EQ(viewer.AwaitState("play").status, 0);
  for (int i = 20; i < kMessages; ++i) EXPECT_EQ(viewer.AwaitReading(), i);
  const Viewer::State ended = viewer.AwaitState("");
  EXPECT_EQ(ended.status, 3);
  EXPECT_EQ(ended.time, kBegin + 30 * kStep);
}

TEST_F(PlaybackTest, PlaysAgainAfterItsEnd) {
  Viewer viewer(server_->port(), "trial.mcap", kSdkV1);
  viewer.Subscribe();
  viewer.AwaitState("");
  for (int pass = 0; pass < 2; ++pass) {
    viewer.Control(true, 10, std::nullopt, "play");
    EXPECT_EQ(viewer.AwaitState("play").status, 0);
    for (int i = 0; i < kMessages; ++i) EXPECT_EQ(viewer.AwaitReading(), i);
    while (viewer.AwaitState("").status != 3) {
    }
  }
}

TEST_F(PlaybackTest, PlaysOnceForAClientThatCannotSteer) {
  Viewer viewer(server_->port(), "trial.mcap", kWebSocketV1);
  EXPECT_EQ(viewer.Await("serverInfo")["capabilities"], Json{"time"});
  viewer.Subscribe();
  for (int i = 0; i < kMessages; ++i) EXPECT_EQ(viewer.AwaitReading(), i);
}

TEST_F(PlaybackTest, PlaysNothingOutsideItsFolder) {
  for (const char* file :
       {"..%2Fetc%2Fpasswd", "%2Fetc%2Fpasswd.mcap", ".hidden.mcap", "trial.csv"}) {
    Viewer viewer(server_->port(), file, kSdkV1);
    const Json status = viewer.Await("status");
    EXPECT_EQ(status.value("message", ""), "this is no recording's name") << file;
  }
  Viewer viewer(server_->port(), "none.mcap", kSdkV1);
  EXPECT_EQ(viewer.Await("status")["level"], 2);
}

}  // namespace
}  // namespace exemplar::gateway::foxglove
