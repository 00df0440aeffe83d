#include "rtps_messages.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace exemplar::bus {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr RtpsSource kExecutor = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
const Bytes kAnnouncer = {0, 1, 0, 0xc2}, kHandshaker = {0, 2, 1, 0xc3},
            kKeyExchanger = {0xff, 2, 2, 0xc3}, kOfAProgram = {0, 0, 1, 2};

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Bytes Submessage(std::uint8_t id, std::uint8_t flags, const Bytes& body) {
  const auto length = static_cast<std::uint16_t>(body.size());
  const auto low = static_cast<std::uint8_t>(length & 0xff);
  const auto high = static_cast<std::uint8_t>(length >> 8);
  const bool little = (flags & 1) != 0;
  return Bytes{id, flags, little ? low : high, little ? high : low} + body;
}

Bytes Data(const Bytes& writer, std::uint8_t flags = 0x05) {
  return Submessage(0x15, flags, Bytes{0, 0, 16, 0, 0, 0, 0, 0} + writer + Bytes(24));
}
/// A gap, a heartbeat or an acknowledgment.
Bytes About(std::uint8_t id, const Bytes& writer) {
  return Submessage(id, 0x01, Bytes(4) + writer + Bytes(20));
}
Bytes From(const RtpsSource& source) {
  return Submessage(0x0c, 0x01, Bytes(8) + Bytes(source.begin(), source.end()));
}
const Bytes kTime = Submessage(0x09, 0x01, Bytes(8));
const Bytes kTo = Submessage(0x0e, 0x01, Bytes(12));

TEST(RtpsMessagesTest, AnnouncementsAndHandshakesAreGreetings) {
  EXPECT_TRUE(OnlyGreets({}));
  EXPECT_TRUE(OnlyGreets(kTime + Data(kAnnouncer)));
  EXPECT_TRUE(OnlyGreets(kTo + kTime + Data(kHandshaker)));
  EXPECT_TRUE(OnlyGreets(Submessage(0x16, 0x01, Bytes(8) + kHandshaker + Bytes(40))));
  // What is encrypted for itself shows when it is decrypted.
  EXPECT_TRUE(OnlyGreets(kTo + Submessage(0x31, 0x01, Bytes(20)) +
                         Submessage(0x30, 0x01, Bytes(36)) + Submessage(0x32, 0x01, Bytes(20))));
}

TEST(RtpsMessagesTest, SamplesAndWhatIsSaidOfThemAreNone) {
  EXPECT_FALSE(OnlyGreets(Data(kOfAProgram)));
  EXPECT_FALSE(OnlyGreets(Data(kAnnouncer) + Data(kOfAProgram)));
  EXPECT_FALSE(OnlyGreets(kTime + kTo + Data(kOfAProgram, 0x04)));  // big-endian
  for (const std::uint8_t id : Bytes{0x06, 0x07, 0x08, 0x12, 0x13}) {
    for (const Bytes& writer : {kOfAProgram, kAnnouncer, kHandshaker, kKeyExchanger}) {
      EXPECT_FALSE(OnlyGreets(About(id, writer))) << int(id);
    }
  }
  // "All that is left" is a length, too.
  Bytes endless = Data(kOfAProgram);
  endless[2] = endless[3] = 0;
  EXPECT_FALSE(OnlyGreets(endless));
}

/// An announcement with these parameters before its sample.
Bytes Announcement(const Bytes& inline_qos, std::uint8_t flags = 0x07) {
  return Submessage(
      0x15, flags,
      Bytes{0, 0, 16, 0, 0, 1, 0, 0xc7} + kAnnouncer + Bytes(8) + inline_qos + Bytes(24));
}

TEST(RtpsMessagesTest, ThatAParticipantGoesIsNotBelievedInClear) {
  const Bytes related = Bytes{0x0f, 0x80, 24, 0} + Bytes(24), end = {1, 0, 0, 0};
  const Bytes goes = {0x71, 0, 4, 0, 0, 0, 0, 3};
  EXPECT_TRUE(OnlyGreets(Announcement(related + end)));
  EXPECT_FALSE(OnlyGreets(Announcement(goes + end)));
  EXPECT_FALSE(OnlyGreets(Announcement(related + goes + end)));
  EXPECT_FALSE(OnlyGreets(Announcement(goes + end, 0x03)));
  // No sample, another way to the parameters, no end of them.
  EXPECT_FALSE(OnlyGreets(Data(kAnnouncer, 0x01)));
  EXPECT_FALSE(OnlyGreets(Data(kAnnouncer, 0x09)));
  Bytes detour = Announcement(related + end);
  detour[6] = 20;
  EXPECT_FALSE(OnlyGreets(detour));
  EXPECT_FALSE(OnlyGreets(Announcement(Bytes{0x0f, 0x80, 0xff, 0xff})));
  EXPECT_FALSE(OnlyGreets(Announcement({})));
}

TEST(RtpsMessagesTest, NobodySpeaksForAnother) {
  RtpsSource other = kExecutor;
  other.back() = 99;
  EXPECT_TRUE(SpeaksForItself(From(kExecutor) + kTo + Data(kOfAProgram), kExecutor));
  EXPECT_FALSE(SpeaksForItself(From(kExecutor) + Data(kOfAProgram) + From(other), kExecutor));
  EXPECT_FALSE(SpeaksForItself(Submessage(0x0c, 0x01, Bytes(8)), kExecutor));
  EXPECT_FALSE(OnlyGreets(From(kExecutor) + Data(kAnnouncer)));
  EXPECT_FALSE(OnlyExchangesKeys(From(kExecutor) + Data(kKeyExchanger)));
}

TEST(RtpsMessagesTest, TheExchangeOfKeysIsOfItsWriterAlone) {
  EXPECT_TRUE(OnlyExchangesKeys(kTime));
  EXPECT_TRUE(OnlyExchangesKeys(Data(kKeyExchanger)));
  EXPECT_TRUE(OnlyExchangesKeys(About(0x07, kKeyExchanger)));
  EXPECT_FALSE(OnlyExchangesKeys(Data(kOfAProgram)));
  EXPECT_FALSE(OnlyExchangesKeys(Data(kHandshaker)));
}

TEST(RtpsMessagesTest, TakesAnyBytesAndStopsWhereTheyAreNoSubmessage) {
  EXPECT_TRUE(OnlyGreets(Bytes{0x15, 0x01}));
  EXPECT_TRUE(OnlyGreets(Bytes{0x15, 0x01, 0xff, 0xff, 0, 0}));
  EXPECT_FALSE(OnlyGreets(Submessage(0x15, 0x05, Bytes(3))));
  std::mt19937 rng(7);
  for (int i = 0; i < 20000; ++i) {
    Bytes bytes(rng() % 80);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(rng());
    // Whatever it says of them, a forged sample behind a whole time stamp does not pass.
    (void)SpeaksForItself(bytes, kExecutor);
    (void)OnlyExchangesKeys(bytes);
    (void)OnlyGreets(bytes);
    EXPECT_FALSE(OnlyGreets(kTime + Data(kOfAProgram) + bytes));
  }
}

}  // namespace
}  // namespace exemplar::bus
