#include "gateway/foxglove/protocol.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "exemplar/base/rng.hpp"

namespace exemplar::gateway::foxglove {
namespace {

using Json = nlohmann::json;

std::span<const std::byte> Bytes(const std::string& text) {
  return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
}

std::string WhyNot(const std::string& text) {
  const auto message = ParseText(text);
  return message.ok() ? "" : message.error().message;
}

TEST(ClientText, IsReadAsTheProtocolHasIt) {
  const auto subscribe = ParseText(
      R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":4294967295,"channelId":5}]})");
  ASSERT_TRUE(subscribe.ok()) << subscribe.error().message;
  const std::vector<SubscribeOp::One> wanted = {{0, 3}, {4294967295, 5}};
  EXPECT_EQ(std::get<SubscribeOp>(*subscribe).subscriptions, wanted);
  const auto unsubscribe = ParseText(R"({"op":"unsubscribe","subscriptionIds":[1,2]})");
  EXPECT_EQ(std::get<UnsubscribeOp>(*unsubscribe).ids, (std::vector<std::uint32_t>{1, 2}));
  const auto advertise = ParseText(
      R"({"op":"advertise","channels":[{"id":7,"topic":"a","encoding":"json","schemaName":"S"}]})");
  ASSERT_TRUE(advertise.ok());
  EXPECT_EQ(std::get<AdvertiseOp>(*advertise).channels.at(0).topic, "a");
  const auto unadvertise = ParseText(R"({"op":"unadvertise","channelIds":[7]})");
  EXPECT_EQ(std::get<UnadvertiseOp>(*unadvertise).ids, std::vector<std::uint32_t>{7});
  EXPECT_EQ(std::get<UnofferedOp>(*ParseText(R"({"op":"getParameters"})")).op, "getParameters");
}

TEST(ClientText, IsRefusedWithTheMemberAtFault) {
  EXPECT_EQ(WhyNot("{"), "not JSON at byte 2");
  EXPECT_EQ(WhyNot(""), "not JSON at byte 1");
  EXPECT_EQ(WhyNot("[]"), "the message must be an object");
  EXPECT_EQ(WhyNot("{}"), "op must be there");
  EXPECT_EQ(WhyNot(R"({"op":3})"), "op must be a string");
  EXPECT_EQ(WhyNot(R"({"op":"dance"})"), "op \"dance\" is not known");
  EXPECT_EQ(WhyNot(R"({"op":"subscribe"})"), "subscriptions must be an array");
  EXPECT_EQ(WhyNot(R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":3}]})"),
            "subscriptions[0].id must be a whole number from 0 to 4294967295");
  EXPECT_EQ(WhyNot(R"({"op":"subscribe","subscriptions":[{"id":1},{"id":4294967296}]})"),
            "subscriptions[0].channelId must be there");
  EXPECT_EQ(WhyNot(R"({"op":"unsubscribe","subscriptionIds":[1.5]})"),
            "subscriptionIds[0] must be a whole number from 0 to 4294967295");
  EXPECT_EQ(WhyNot(R"({"op":"advertise","channels":[{"id":1,"topic":[],"encoding":"cdr"}]})"),
            "channels[0].topic must be a string");
}

TEST(ClientText, MayNestOnlySoDeepAndListOnlySoMuch) {
  EXPECT_TRUE(CheckJson(std::string(32, '[') + std::string(32, ']')).ok());
  EXPECT_FALSE(CheckJson(std::string(33, '[') + std::string(33, ']')).ok());
  EXPECT_FALSE(CheckJson(std::string(1'000'000, '[')).ok());
  std::string ids = "0";
  for (int i = 0; i < 10'000; ++i) ids += ",1";
  EXPECT_EQ(WhyNot(R"({"op":"unsubscribe","subscriptionIds":[)" + ids + "]}"),
            "subscriptionIds must be no longer than 10000 entries");
}

TEST(ClientBytes, AreReadAsTheProtocolHasThem) {
  const std::string data("\x01\x1e\0\0\0{\"a\"}", 10);
  const auto message = ParseBinary(Bytes(data));
  ASSERT_TRUE(message.ok());
  EXPECT_EQ(std::get<ClientData>(*message).channel, 30U);
  EXPECT_EQ(std::get<ClientData>(*message).payload.size(), 5U);

  const std::string call("\x02\x0a\0\0\0\x0c\0\0\0\x04\0\0\0json{}", 19);
  const auto service = ParseBinary(Bytes(call));
  ASSERT_TRUE(service.ok());
  EXPECT_EQ(std::get<ServiceCall>(*service).service, 10U);
  EXPECT_EQ(std::get<ServiceCall>(*service).call, 12U);
  EXPECT_EQ(std::get<ServiceCall>(*service).encoding, "json");
  EXPECT_EQ(std::get<ServiceCall>(*service).payload.size(), 2U);

  const std::string control("\x03\x01\0\0\xc0\x3f\x01\x40\x42\x0f\0\0\0\0\0\x02\0\0\0id", 21);
  const auto playback = ParseBinary(Bytes(control));
  ASSERT_TRUE(playback.ok()) << playback.error().message;
  const auto& read = std::get<PlaybackControl>(*playback);
  EXPECT_FALSE(read.play);
  EXPECT_EQ(read.speed, 1.5);
  EXPECT_EQ(read.seek, Stamp::FromNanoseconds(1'000'000));
  EXPECT_EQ(read.request_id, "id");
}

TEST(ClientBytes, AreRefusedWhenTheyAreCutOrOfNoKind) {
  const std::string whole[] = {
      std::string("\x01\x1e\0\0\0", 5), std::string("\x02\x0a\0\0\0\x0c\0\0\0\x04\0\0\0json", 17),
      std::string("\x03\x01\0\0\xc0\x3f\x01\x40\x42\x0f\0\0\0\0\0\x02\0\0\0id", 21)};
  for (const std::string& message : whole) {
    EXPECT_TRUE(ParseBinary(Bytes(message)).ok());
    for (std::size_t size = 0; size < message.size(); ++size) {
      EXPECT_FALSE(ParseBinary(Bytes(message.substr(0, size))).ok()) << size;
    }
  }
  for (int opcode = 4; opcode < 256; ++opcode) {
    EXPECT_FALSE(ParseBinary(Bytes(std::string(1, static_cast<char>(opcode)) + "aaaaaaaa")).ok());
  }
  EXPECT_FALSE(ParseBinary(Bytes(std::string("\x02\0\0\0\0\0\0\0\0\xff\xff\xff\xff", 13))).ok());
  std::string control = whole[2];
  control[1] = 2;
  EXPECT_FALSE(ParseBinary(Bytes(control)).ok()) << "no such command";
  control = whole[2];
  std::memcpy(control.data() + 2, "\0\0\xc0\x7f", 4);
  EXPECT_FALSE(ParseBinary(Bytes(control)).ok()) << "speed is not a number";
}

/// The short form of tests/fuzz/foxglove_fuzz.cpp.
TEST(ClientMessages, AreReadOrRefusedWhateverIsDoneToThem) {
  const std::string seeds[] = {
      R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":3}]})",
      R"({"op":"advertise","channels":[{"id":7,"topic":"a","encoding":"json","schemaName":"S"}]})",
      R"({"op":"unsubscribe","subscriptionIds":[1,2]})",
      std::string("\x02\x0a\0\0\0\x0c\0\0\0\x04\0\0\0json{}", 19),
      std::string("\x03\x01\0\0\xc0\x3f\x01\x40\x42\x0f\0\0\0\0\0\x02\0\0\0id", 21)};
  Rng rng(11);
  int read = 0;
  int refused = 0;
  for (int round = 0; round < 20'000; ++round) {
    std::string message = seeds[rng.Below(5)];
    for (std::uint64_t changes = rng.Below(4); changes > 0; --changes) {
      const std::size_t at = rng.Below(message.size());
      switch (rng.Below(3)) {
        case 0:
          message[at] = static_cast<char>(rng.Below(256));
          break;
        case 1:
          message.erase(at, rng.Below(8));
          break;
        default:
          message.insert(at, message.substr(rng.Below(message.size()), rng.Below(12)));
      }
      if (message.empty()) message = "{";
    }
    ++(ParseText(message).ok() ? read : refused);
    ++(ParseBinary(Bytes(message)).ok() ? read : refused);
  }
  EXPECT_GT(read, 1000);
  EXPECT_GT(refused, 1000);
}

TEST(ServerTexts, AreJsonWhateverATopicHoldsInItsNames) {
  const ChannelInfo channel{.id = 1, .topic = "a\"\n\xff", .schema_name = "S", .schema = "struct"};
  const Json advertise = Json::parse(AdvertiseText({&channel, 1}));
  EXPECT_EQ(advertise["op"], "advertise");
  EXPECT_EQ(advertise["channels"][0]["schemaEncoding"], "omgidl");
  const Json info = Json::parse(ServerInfoText(
      {.name = "n",
       .capabilities = {"time"},
       .range = std::pair(Stamp::FromNanoseconds(1'500'000'000), Stamp::FromSeconds(3))}));
  EXPECT_EQ(info["dataStartTime"], (Json{{"sec", 1}, {"nsec", 500'000'000}}));
  EXPECT_FALSE(info.contains("supportedEncodings"));
  const Json failure = Json::parse(ServiceFailureText(1, 2, "no"));
  EXPECT_EQ(
      failure,
      (Json{{"op", "serviceCallFailure"}, {"serviceId", 1}, {"callId", 2}, {"message", "no"}}));
}

TEST(ServerBytes, AreAsTheProtocolHasThem) {
  EXPECT_EQ(MessageHead(30, Stamp::FromNanoseconds(1234)),
            std::string("\x01\x1e\0\0\0\xd2\x04\0\0\0\0\0\0", 13));
  EXPECT_EQ(TimeBytes(Stamp::FromNanoseconds(1234)), std::string("\x02\xd2\x04\0\0\0\0\0\0", 9));
  EXPECT_EQ(ServiceResponseBytes(10, 12, "json", "{}"),
            std::string("\x03\x0a\0\0\0\x0c\0\0\0\x04\0\0\0json{}", 19));
  EXPECT_EQ(
      PlaybackStateBytes(PlaybackStatus::kEnded, Stamp::FromNanoseconds(1234), 1.5, true, "i"),
      std::string("\x05\x03\xd2\x04\0\0\0\0\0\0\0\0\xc0\x3f\x01\x01\0\0\0i", 20));
}

}  // namespace
}  // namespace exemplar::gateway::foxglove
