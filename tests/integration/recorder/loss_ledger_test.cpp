#include "recorder/loss_ledger.hpp"

#include <gmock/gmock.h>

#include "cdr.hpp"
#include "exemplar/base/rng.hpp"

namespace exemplar::recorder {
namespace {

constexpr const char* kSuit = "ircp/suit";
constexpr const char* kWriter = "01.0f.aa|0.0.1.3";

ircp::RawTopic Topic(const std::string& name, const std::string& type) {
  ircp::RawTopic topic;
  topic.topic = name;
  topic.type = type;
  topic.schema = type.starts_with("exemplar") ? HeaderIdl("Suit") : "struct Reading { long x; };";
  return topic;
}

class LossLedgerTest : public ::testing::Test {
 protected:
  LossLedgerTest() {
    ledger_.AddTopic(Topic(kSuit, "exemplar::ircp::v1::Suit"));
    ledger_.AddTopic(Topic("strange", "lab::Reading"));
  }

  void Receive(std::uint64_t seq, const std::string& writer = kWriter,
               const std::string& source = "suit") {
    ircp::RawSample sample;
    sample.topic = kSuit;
    sample.writer = writer;
    sample.sequence = 1000 + seq;  // the protocol's own count differs
    sample.cdr = SampleBytes(source, seq);
    ledger_.AddReceived(sample, now_);
  }
  void ReceiveStrange(std::uint64_t sequence, bool valid = true) {
    ircp::RawSample sample;
    sample.topic = "strange";
    sample.writer = "09|1";
    sample.sequence = sequence;
    sample.valid = valid;
    ledger_.AddReceived(sample, now_);
  }
  api::TopicFigures Figures(const std::string& topic) const {
    for (const api::TopicFigures& figures : ledger_.TopicFigures(now_)) {
      if (figures.topic == topic) return figures;
    }
    return {};
  }

  LossLedger ledger_;
  Duration now_{0};
};

TEST_F(LossLedgerTest, CountsGapsAndFillsThemByLateSamples) {
  for (const std::uint64_t seq : {1u, 2u, 5u, 6u, 9u}) Receive(seq);
  EXPECT_EQ(Figures(kSuit).received, 5u);
  EXPECT_EQ(Figures(kSuit).lost, 4u);
  Receive(4);
  Receive(4);
  EXPECT_EQ(Figures(kSuit).received, 6u);
  EXPECT_EQ(Figures(kSuit).lost, 3u);
  EXPECT_EQ(Figures(kSuit).sent, 9u);
}

TEST_F(LossLedgerTest, CountsTheEndUpToWhatTheWriterAnnounced) {
  for (std::uint64_t seq = 1; seq <= 10; ++seq) Receive(seq);
  EXPECT_TRUE(ledger_.HasAllAnnounced(now_));
  ledger_.AddAnnounced("01.0f.aa|0.0.9.3", {kSuit, "suit", 13}, now_);
  EXPECT_FALSE(ledger_.HasAllAnnounced(now_));
  EXPECT_EQ(Figures(kSuit).lost, 3u);
  EXPECT_EQ(Figures(kSuit).sent, 13u);
  Receive(13);
  EXPECT_TRUE(ledger_.HasAllAnnounced(now_));
  EXPECT_EQ(Figures(kSuit).lost, 2u);
  Receive(14);
  EXPECT_EQ(Figures(kSuit).sent, 14u);
}

TEST_F(LossLedgerTest, AwaitsNothingMoreOfAWriterThatHasDied) {
  for (std::uint64_t seq = 1; seq <= 10; ++seq) Receive(seq);
  ledger_.AddAnnounced("01.0f.aa|0.0.9.3", {kSuit, "suit", 13}, now_);
  EXPECT_FALSE(ledger_.HasAllAnnounced(now_));
  now_ += std::chrono::seconds(3);
  EXPECT_TRUE(ledger_.HasAllAnnounced(now_));
  EXPECT_EQ(Figures(kSuit).lost, 3u);
  ledger_.AddAnnounced("01.0f.aa|0.0.9.3", {kSuit, "suit", 14}, now_);
  EXPECT_FALSE(ledger_.HasAllAnnounced(now_));
}

TEST_F(LossLedgerTest, KeepsARestartedProgramApartFromItsFormerLife) {
  for (std::uint64_t seq = 1; seq <= 10; ++seq) Receive(seq);
  ledger_.AddAnnounced("01.0f.aa|0.0.9.3", {kSuit, "suit", 12}, now_);
  for (std::uint64_t seq = 1; seq <= 5; ++seq) Receive(seq, "02.0f.bb|0.0.1.3");
  ledger_.AddAnnounced("02.0f.bb|0.0.9.3", {kSuit, "suit", 5}, now_);
  EXPECT_EQ(Figures(kSuit).received, 15u);
  EXPECT_EQ(Figures(kSuit).lost, 2u);
  EXPECT_EQ(Figures(kSuit).sent, 17u);
}

TEST_F(LossLedgerTest, CountsStrangersByTheProtocolsNumbers) {
  for (const std::uint64_t sequence : {4u, 5u, 8u}) ReceiveStrange(sequence);
  ReceiveStrange(9, false);  // the end of an instance uses up a number and is no sample
  EXPECT_EQ(Figures("strange").received, 3u);
  EXPECT_EQ(Figures("strange").lost, 2u);
  EXPECT_EQ(Figures("strange").type, "lab::Reading");
}

TEST_F(LossLedgerTest, CountsWhatTheRecorderDroppedAsLost) {
  for (std::uint64_t seq = 1; seq <= 10; ++seq) Receive(seq);
  ledger_.AddDropped(kSuit, kWriter);
  ledger_.AddDropped(kSuit, kWriter);
  EXPECT_EQ(Figures(kSuit).received, 8u);
  EXPECT_EQ(Figures(kSuit).lost, 2u);
  EXPECT_EQ(Figures(kSuit).sent, 10u);
}

TEST_F(LossLedgerTest, TellsWhatHappenedBetweenTwoLooks) {
  for (const std::uint64_t seq : {1u, 3u}) Receive(seq);
  const std::vector<WriterFigures> before = ledger_.writers();
  ReceiveStrange(1);
  EXPECT_THAT(Difference(before, before), ::testing::IsEmpty());
  for (const std::uint64_t seq : {6u, 7u}) Receive(seq);
  const std::vector<WriterFigures> between = Difference(ledger_.writers(), before);
  ASSERT_EQ(between.size(), 2u);
  EXPECT_EQ(between[0].topic, kSuit);
  EXPECT_EQ(between[0].received, 2u);
  EXPECT_EQ(between[0].lost(), 2u);
  EXPECT_EQ(between[1].received, 1u);
}

TEST_F(LossLedgerTest, MeasuresTheRate) {
  for (std::uint64_t seq = 1; seq <= 300; ++seq) {
    now_ += std::chrono::milliseconds(10);
    Receive(seq);
  }
  EXPECT_NEAR(Figures(kSuit).rate_hz, 100, 2);
  now_ += std::chrono::seconds(5);
  EXPECT_EQ(Figures(kSuit).rate_hz, 0);
}

TEST_F(LossLedgerTest, SentIsReceivedAndLostForAnyOrderOfArrival) {
  Rng rng(8);
  for (int round = 0; round < 50; ++round) {
    const std::string writer = std::to_string(round) + "|1";
    std::uint64_t arrived = 0;
    Receive(1, writer);
    for (std::uint64_t seq = 2; seq <= 100; ++seq) {
      if (rng.Uniform() < 0.7) {
        Receive(seq % 2 == 0 ? seq + 1 : seq - 1, writer);
        ++arrived;
      }
    }
    EXPECT_GT(arrived, 0u);
    const api::TopicFigures figures = Figures(kSuit);
    EXPECT_EQ(figures.sent, figures.received + figures.lost);
  }
}

}  // namespace
}  // namespace exemplar::recorder
