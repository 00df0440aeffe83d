#include "gateway/foxglove/bridge.hpp"

#include <gmock/gmock.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "gateway/foxglove/station_services.hpp"
#include "integration/gateway/memory_station.hpp"
#include "support/eventually.hpp"
#include "unit/http/raw_client.hpp"

namespace exemplar::gateway::foxglove {
namespace {

using exemplar::testing::Eventually;
using http::testing::RawClient;
using ::testing::HasSubstr;
using Json = nlohmann::json;

/// A client of the protocol that keeps what it gets.
class Client {
 public:
  explicit Client(int port, const std::string& subprotocol = kWebSocketV1, int receive_buffer = 0,
                  const std::string& path = "/")
      : socket_(port, receive_buffer) {
    answer = socket_.Upgrade(path, "Sec-WebSocket-Protocol: " + subprotocol + "\r\n");
  }
  void Send(const Json& json) { socket_.SendFrame(0x81, json.dump()); }
  void SendText(const std::string& text) { socket_.SendFrame(0x81, text); }
  void SendBytes(const std::string& bytes) { socket_.SendFrame(0x82, bytes); }
  /// The next text of that kind; others before it are left out.
  Json Await(const std::string& op) {
    while (true) {
      const RawClient::Frame frame = socket_.ReadFrame();
      if (frame.first < 0) return {};
      if (frame.first != 0x81) continue;
      Json json = Json::parse(frame.payload);
      if (json["op"] == op) return json;
    }
  }
  /// The next binary message of that opcode, without it.
  std::string AwaitBytes(char opcode) {
    while (true) {
      const RawClient::Frame frame = socket_.ReadFrame();
      if (frame.first < 0) return {};
      if (frame.first == 0x82 && frame.payload.at(0) == opcode) return frame.payload.substr(1);
    }
  }
  /// The channel of a topic, as advertised.
  Json AwaitChannel(const std::string& topic) {
    while (true) {
      const Json advertised = Await("advertise");
      if (advertised.is_null()) return {};
      for (const Json& channel : advertised["channels"]) {
        if (channel["topic"] == topic) return channel;
      }
    }
  }
  void Subscribe(std::uint32_t id, const Json& channel) {
    Send({{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channel["id"]}}}}});
  }

  std::string answer;
  RawClient socket_;
};

std::uint32_t NumberAt(const std::string& bytes, std::size_t at) {
  std::uint32_t number = 0;
  if (at + 4 <= bytes.size()) std::memcpy(&number, bytes.data() + at, 4);
  return number;
}

std::string CallBytes(std::uint32_t service, std::uint32_t call, const std::string& encoding,
                      const std::string& payload) {
  std::string bytes = ServiceResponseBytes(service, call, encoding, payload);
  bytes.front() = '\x02';
  return bytes;
}

class BridgeTest : public ::testing::Test {
 protected:
  void SetUp() override { Make({}); }

  void Make(BridgeOptions options) {
    server_.reset();
    bridge_.reset();
    hub_.reset();
    auto hub = TopicHub::Create(station_, station_, clock_, {.publish = {"scale"}});
    ASSERT_TRUE(hub.ok());
    hub_ = std::move(*hub);
    std::vector<Service> services;
    services.push_back({{1, "/echo", "lab/Echo", "{}", "{}"},
                        [](std::string_view request, const http::Request& origin,
                           const std::stop_token&) -> Result<std::string> {
                          if (request == "{}") return InvalidArgument("nothing to echo");
                          return std::string(request) + origin.headers.Get("Host");
                        }});
    bridge_ = Bridge::Create(*hub_, clock_, log_, std::move(services), std::move(options));
    auto server = http::Server::Create({}, log_);
    ASSERT_TRUE(server.ok());
    server_ = std::move(*server);
    ASSERT_TRUE(server_->RouteWebSocket("/", bridge_->Endpoint()).ok());
    server_->Start();
  }
  int port() const { return server_->port(); }

  ManualClock clock_;
  NullLog log_;
  MemoryStation station_;
  std::unique_ptr<TopicHub> hub_;
  std::unique_ptr<Bridge> bridge_;
  std::unique_ptr<http::Server> server_;
};

TEST_F(BridgeTest, GreetsWithWhatThereIs) {
  station_.Appear(ScaleTopic());
  Client client(port());
  EXPECT_THAT(client.answer, HasSubstr("Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n"));
  const Json info = client.Await("serverInfo");
  EXPECT_EQ(info["capabilities"], (Json{"services", "clientPublish"}));
  EXPECT_EQ(info["supportedEncodings"], (Json{"json", "cdr"}));
  const Json channel = client.AwaitChannel("scale");
  EXPECT_EQ(channel["encoding"], "cdr");
  EXPECT_EQ(channel["schemaEncoding"], "omgidl");
  EXPECT_EQ(channel["schemaName"], "lab::Scale");
  EXPECT_EQ(channel["schema"], kScaleIdl);
  EXPECT_EQ(client.Await("advertiseServices")["services"][0]["name"], "/echo");
  Client newer(port(), "foxglove.websocket.v1, foxglove.sdk.v1");
  EXPECT_THAT(newer.answer, HasSubstr("Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n"));
}

TEST_F(BridgeTest, SendsWhatIsSubscribedAndNothingElse) {
  station_.Appear(ScaleTopic());
  station_.Appear(ScaleTopic("other"));
  Client client(port());
  const Json channel = client.AwaitChannel("scale");
  client.Subscribe(77, channel);
  ASSERT_TRUE(Eventually([&] { return hub_->figures().subscriptions == 1; }));
  station_.Arrive("other", 1, {0, 1, 0, 0, 9});
  station_.Arrive("scale", 1, {0, 1, 0, 0, 7});
  const std::string data = client.AwaitBytes('\x01');
  EXPECT_EQ(NumberAt(data, 0), 77U);
  EXPECT_EQ(data.substr(12), std::string("\0\1\0\0\7", 5));
  client.Send({{"op", "unsubscribe"}, {"subscriptionIds", {77}}});
  EXPECT_TRUE(Eventually([&] { return hub_->figures().subscriptions == 0; }));
}

TEST_F(BridgeTest, AdvertisesTopicsThatComeLaterAndNoneWithoutSchema) {
  Client client(port());
  client.Await("advertiseServices");
  ircp::RawTopic bare = ScaleTopic("bare");
  bare.schema.clear();
  station_.Appear(bare);
  station_.Appear(ScaleTopic("late"));
  const Json advertised = client.Await("advertise");
  EXPECT_EQ(advertised["channels"][0]["topic"], "late");
}

TEST_F(BridgeTest, RefusesWhatIsNotOfTheProtocolAndServesOn) {
  station_.Appear(ScaleTopic());
  Client client(port());
  const Json channel = client.AwaitChannel("scale");
  const auto refusal = [&] { return client.Await("status")["message"].get<std::string>(); };
  client.SendText("nonsense");
  EXPECT_THAT(refusal(), HasSubstr("not JSON"));
  client.SendBytes("\x09");
  EXPECT_THAT(refusal(), HasSubstr("opcode 9"));
  client.Subscribe(1, {{"id", 12345}});
  EXPECT_THAT(refusal(), HasSubstr("no channel of id 12345"));
  client.Send({{"op", "unsubscribe"}, {"subscriptionIds", {5}}});
  EXPECT_THAT(refusal(), HasSubstr("no subscription of id 5"));
  client.Subscribe(1, channel);
  client.Subscribe(1, channel);
  EXPECT_THAT(refusal(), HasSubstr("id 1 is in use"));
  client.Subscribe(2, channel);
  EXPECT_THAT(refusal(), HasSubstr("subscribed already"));
  client.SendBytes(std::string("\x01\x05\0\0\0data", 9));
  EXPECT_THAT(refusal(), HasSubstr("no channel of id 5"));
  client.Send({{"op", "setParameters"}});
  EXPECT_THAT(refusal(), HasSubstr("not offered"));
  EXPECT_EQ(bridge_->figures().bad_messages, 8U);
  station_.Arrive("scale", 1, {0, 1, 0, 0, 7});
  EXPECT_EQ(client.AwaitBytes('\x01').size(), 17U);
}

TEST_F(BridgeTest, CallsServicesAndSaysWhyACallFails) {
  Client client(port());
  client.Await("advertiseServices");
  client.SendBytes(CallBytes(1, 5, "json", "[1]"));
  EXPECT_EQ("\x03" + client.AwaitBytes('\x03'), ServiceResponseBytes(1, 5, "json", "[1]127.0.0.1"));
  client.SendBytes(CallBytes(1, 6, "json", "{}"));
  Json failure = client.Await("serviceCallFailure");
  EXPECT_EQ(failure["callId"], 6);
  EXPECT_EQ(failure["message"], "nothing to echo");
  client.SendBytes(CallBytes(9, 7, "json", "{}"));
  EXPECT_THAT(client.Await("serviceCallFailure")["message"].get<std::string>(),
              HasSubstr("no service of id 9"));
  client.SendBytes(CallBytes(1, 8, "cdr", "{}"));
  EXPECT_THAT(client.Await("serviceCallFailure")["message"].get<std::string>(),
              HasSubstr("\"cdr\" is not json"));
  client.SendBytes(CallBytes(1, 9, "json", "{"));
  EXPECT_THAT(client.Await("serviceCallFailure")["message"].get<std::string>(),
              HasSubstr("not JSON"));
  EXPECT_EQ(bridge_->figures().calls, 5U);
  EXPECT_EQ(bridge_->figures().failed_calls, 4U);
}

TEST_F(BridgeTest, PublishesForClientsWhereItMay) {
  station_.Appear(ScaleTopic());
  station_.Appear(ScaleTopic("forbidden"));
  Client client(port());
  client.Await("advertiseServices");
  const auto advertise = [&](int id, const char* topic, const char* encoding) {
    client.Send(
        {{"op", "advertise"},
         {"channels",
          {{{"id", id}, {"topic", topic}, {"encoding", encoding}, {"schemaName", "lab::Scale"}}}}});
  };
  advertise(1, "scale", "json");
  advertise(2, "forbidden", "json");
  client.SendBytes(std::string("\x01\x01\0\0\0", 5) + R"({"mass_kg": 2.5})");
  EXPECT_TRUE(Eventually([&] { return bridge_->figures().published == 1; }));
  EXPECT_EQ(station_.written.size(), 1U);
  client.SendBytes(std::string("\x01\x02\0\0\0", 5) + R"({"mass_kg": 2.5})");
  EXPECT_THAT(client.Await("status")["message"].get<std::string>(), HasSubstr("forbidden"));
  client.SendBytes(std::string("\x01\x01\0\0\0", 5) + std::string(100'000, '['));
  EXPECT_THAT(client.Await("status")["message"].get<std::string>(), HasSubstr("nested deeper"));
  advertise(3, "scale", "xml");
  EXPECT_THAT(client.Await("status")["message"].get<std::string>(), HasSubstr("xml"));
  EXPECT_EQ(bridge_->figures().refused, 2U);
  EXPECT_EQ(station_.written.size(), 1U);
}

TEST_F(BridgeTest, KeepsAMessageForThoseWhoSubscribeLater) {
  const std::uint32_t id =
      bridge_->AddChannel({.topic = "own", .schema_name = "S", .schema = "struct S { octet a; };"});
  bridge_->Publish(id, Stamp::FromNanoseconds(5), "kept", true);
  Client client(port());
  client.Subscribe(3, client.AwaitChannel("own"));
  const std::string first = client.AwaitBytes('\x01');
  EXPECT_EQ(NumberAt(first, 0), 3U);
  EXPECT_EQ(first.substr(12), "kept");
  bridge_->Publish(id, Stamp::FromNanoseconds(6), "later", false);
  EXPECT_EQ(client.AwaitBytes('\x01').substr(12), "later");
}

TEST_F(BridgeTest, DropsForAStalledClientTellsItAndSlowsNobody) {
  BridgeOptions options;
  options.endpoint.queue_bytes = 200'000;
  Make(std::move(options));
  station_.Appear(ScaleTopic());
  Client stalled(port(), kWebSocketV1, 4096);
  Client good(port());
  stalled.Subscribe(1, stalled.AwaitChannel("scale"));
  good.Subscribe(1, good.AwaitChannel("scale"));
  ASSERT_TRUE(Eventually([&] { return hub_->figures().subscriptions == 2; }));
  constexpr std::uint64_t kSamples = 2000;
  for (std::uint64_t i = 1; i <= kSamples; ++i) {
    station_.Arrive("scale", i, std::vector<std::uint8_t>(10'000, 1));
    ASSERT_EQ(good.AwaitBytes('\x01').size(), 10'012U) << i;
  }
  ASSERT_TRUE(Eventually([&] { return bridge_->figures().dropped > 0; }));
  const Json status = stalled.Await("status");
  EXPECT_EQ(status["level"], 1);
  EXPECT_THAT(status["message"].get<std::string>(), HasSubstr("scale: "));
  EXPECT_EQ(bridge_->figures().clients, 2U);
}

TEST_F(BridgeTest, TellsSimulatedTime) {
  BridgeOptions options;
  options.simulated_time = true;
  Make(std::move(options));
  Client client(port());
  EXPECT_THAT(client.Await("serverInfo")["capabilities"], ::testing::Contains("time"));
  EXPECT_EQ("\x02" + client.AwaitBytes('\x02'), TimeBytes(clock_.Now()));
}

TEST_F(BridgeTest, LetsNobodyLookOrPublishWhoMayNot) {
  BridgeOptions options;
  options.permit = [](const http::Request& request) -> Permission {
    const std::string authorization = AuthorizationOf(request);
    return {authorization == "Bearer a b" || authorization == "Bearer look",
            authorization == "Bearer a b"};
  };
  Make(std::move(options));
  Client stranger(port());
  EXPECT_THAT(stranger.Await("status")["message"].get<std::string>(), HasSubstr("token"));
  Client publisher(port(), kSdkV1, 0, "/?token=a+b");
  EXPECT_EQ(publisher.Await("serverInfo")["capabilities"], (Json{"services", "clientPublish"}));
  Client looker(port(), kSdkV1, 0, "/?token=look");
  EXPECT_EQ(looker.Await("serverInfo")["capabilities"], Json{"services"});
  looker.Send({{"op", "advertise"}, {"channels", Json::array()}});
  EXPECT_EQ(looker.Await("status")["message"], "you may not publish");
  EXPECT_EQ(bridge_->figures().refused_clients, 1U);
}

TEST_F(BridgeTest, ForgetsClientsThatGo) {
  station_.Appear(ScaleTopic());
  {
    Client client(port());
    client.Subscribe(1, client.AwaitChannel("scale"));
    ASSERT_TRUE(Eventually([&] { return hub_->figures().subscriptions == 1; }));
  }
  EXPECT_TRUE(Eventually([&] { return bridge_->figures().clients == 0; }));
  EXPECT_TRUE(Eventually([&] { return hub_->figures().subscriptions == 0; }));
}

/// Calls that say what they were given.
class NotedCalls final : public api::JsonCalls {
 public:
  const std::vector<api::JsonMethod>& methods() const override { return methods_; }
  std::string OpenApi() const override {
    return R"({"paths":{"/exemplar.v1.RecorderService/Start":{"post":{"requestBody":{"content":
      {"application/json":{"schema":{"$ref":"#/components/schemas/Start"}}}}}}},"components":
      {"schemas":{"Start":{"type":"object","properties":{"next":
      {"$ref":"#/components/schemas/Start"}}}}}})";
  }
  std::optional<api::JsonFailure> Call(
      const api::JsonCall& call, const std::function<bool(std::string&&)>& on_answer) override {
    if (call.metadata.empty()) return api::JsonFailure{401, "unauthenticated", "who?", ""};
    on_answer("{\"part\": 1}");
    on_answer(
        Json{{"method", call.method}, {"body", call.body}, {"as", call.metadata[0].second}}.dump());
    return std::nullopt;
  }

 private:
  std::vector<api::JsonMethod> methods_ = {{"exemplar.v1.RecorderService", "Start"},
                                           {"exemplar.v1.ExecutorService", "Execute"}};
};

TEST(StationServices, AreTheGatewaysCallsUnderTheClientsAuthorization) {
  NotedCalls calls;
  const std::vector<Service> services = StationServices(calls);
  ASSERT_EQ(services.size(), 2U);
  EXPECT_EQ(services[0].info.name, "/recorder/start");
  EXPECT_EQ(services[1].info.name, "/executor/execute");
  const Json schema = Json::parse(services[0].info.request_schema);
  EXPECT_EQ(schema["properties"]["next"]["type"], "object") << "references are put in";
  http::Request origin;
  const auto refused = services[1].call("{}", origin, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().message, "unauthenticated: who?");
  origin.headers.Add("Authorization", "Bearer t");
  const auto answer = services[1].call(R"({"a":1})", origin, {});
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(Json::parse(*answer), (Json{{"method", "exemplar.v1.ExecutorService/Execute"},
                                        {"body", "{\"a\":1}"},
                                        {"as", "Bearer t"}}));
}

}  // namespace
}  // namespace exemplar::gateway::foxglove
