#include "gateway/topic_hub.hpp"

#include <gtest/gtest.h>

#include "exemplar/dynamic_data/json.hpp"
#include "gateway/topic_server.hpp"
#include "memory_station.hpp"

namespace exemplar::gateway {
namespace {

using std::chrono::milliseconds;

std::vector<std::uint8_t> ScaleSample(std::uint64_t number) {
  const auto type = dynamic_data::ParseType(kScaleIdl, "lab::Scale");
  return *dynamic_data::FromJson(**type, R"({"source":"scale","seq":)" + std::to_string(number) +
                                             R"(,"stamp_ns":5,"mass_kg":1.5})");
}

class TopicHubTest : public ::testing::Test {
 protected:
  void Make(TopicHubOptions options = {}) {
    hub_ = std::move(*TopicHub::Create(station_, station_, clock_, std::move(options)));
  }
  static std::vector<std::uint64_t> Numbers(Subscription& subscription) {
    std::vector<SamplePtr> samples;
    subscription.Take(samples, 1000);
    std::vector<std::uint64_t> numbers;
    for (const SamplePtr& sample : samples) numbers.push_back(sample->sequence);
    return numbers;
  }

  ManualClock clock_;
  MemoryStation station_;
  std::unique_ptr<TopicHub> hub_;
};

TEST_F(TopicHubTest, MatchesNamesByPatterns) {
  EXPECT_TRUE(MatchesTopic("ircp/suit", {}));
  EXPECT_TRUE(MatchesTopic("ircp/suit", {"other", "ircp/*"}));
  EXPECT_TRUE(MatchesTopic("ircp/executor/status", {"ircp/*/status"}));
  EXPECT_TRUE(MatchesTopic("aXbXc", {"a*b*c"}));
  EXPECT_FALSE(MatchesTopic("ircp/suit", {"ircp", "suit", "*/status"}));
  EXPECT_FALSE(MatchesTopic(std::string(5000, 'a'), {std::string(50, '*') + "b"}));
}

TEST_F(TopicHubTest, GivesEachSubscriptionWhatItAskedFor) {
  Make();
  auto early = *hub_->Subscribe({.topics = {"scale*"}});
  station_.Appear(ScaleTopic("scale"));
  station_.Appear(ScaleTopic("other"));
  auto late = *hub_->Subscribe({.topics = {"other"}});
  station_.Arrive("scale", 1);
  station_.Arrive("other", 2);
  station_.Arrive("unknown", 3);
  EXPECT_EQ(Numbers(*early), (std::vector<std::uint64_t>{1}));
  EXPECT_EQ(Numbers(*late), (std::vector<std::uint64_t>{2}));
  EXPECT_EQ(hub_->figures().received, 2U);
  EXPECT_EQ(hub_->figures().delivered, 2U);
  late.reset();
  EXPECT_EQ(hub_->figures().subscriptions, 1);
}

TEST_F(TopicHubTest, SlowSubscriptionsMissTheOldestAndOthersNothing) {
  Make();
  station_.Appear(ScaleTopic());
  auto slow = *hub_->Subscribe({.max_samples = 3});
  auto quick = *hub_->Subscribe({});
  std::vector<std::uint64_t> seen;
  for (std::uint64_t i = 1; i <= 10; ++i) {
    station_.Arrive("scale", i);
    for (const std::uint64_t number : Numbers(*quick)) seen.push_back(number);
  }
  EXPECT_EQ(Numbers(*slow), (std::vector<std::uint64_t>{8, 9, 10}));
  EXPECT_EQ(slow->missed(), 7U);
  EXPECT_EQ(seen.size(), 10U);
  EXPECT_EQ(quick->missed(), 0U);
  slow.reset();
  EXPECT_EQ(hub_->figures().missed, 7U);
}

TEST_F(TopicHubTest, BoundsWhatWaitsByItsBytes) {
  Make();
  station_.Appear(ScaleTopic());
  auto subscription = *hub_->Subscribe({.max_bytes = 100000});
  for (std::uint64_t i = 1; i <= 100; ++i) {
    station_.Arrive("scale", i, std::vector<std::uint8_t>(30000));
  }
  EXPECT_EQ(Numbers(*subscription), (std::vector<std::uint64_t>{98, 99, 100}));
  station_.Arrive("scale", 101, std::vector<std::uint8_t>(1000000));
  EXPECT_EQ(Numbers(*subscription), (std::vector<std::uint64_t>{101}));
}

TEST_F(TopicHubTest, LimitsTheRateOfEachWriterAlone) {
  Make();
  station_.Appear(ScaleTopic());
  auto subscription = *hub_->Subscribe({.max_rate_hz = 10});
  for (std::uint64_t i = 0; i < 100; ++i) {
    station_.Arrive("scale", i, {}, "a");
    station_.Arrive("scale", 1000 + i, {}, "b");
    clock_.Advance(milliseconds(10));
  }
  const std::vector<std::uint64_t> numbers = Numbers(*subscription);
  EXPECT_EQ(numbers.size(), 20U);
  EXPECT_EQ(subscription->missed(), 0U);
}

TEST_F(TopicHubTest, TellsOnceThatThereIsSomethingToTake) {
  Make();
  station_.Appear(ScaleTopic());
  int told = 0;
  auto subscription = *hub_->Subscribe({.on_ready = [&told] { ++told; }});
  station_.Arrive("scale", 1);
  station_.Arrive("scale", 2);
  EXPECT_EQ(told, 1);
  Numbers(*subscription);
  station_.Arrive("scale", 3);
  EXPECT_EQ(told, 2);
  subscription.reset();
  station_.Arrive("scale", 4);
  EXPECT_EQ(told, 2);
}

TEST_F(TopicHubTest, BeginsWithTheLastSamplesOfThoseThatKeepThem) {
  Make();
  ircp::RawTopic kept = ScaleTopic("kept");
  kept.transient_local = true;
  station_.Appear(kept);
  station_.Appear(ScaleTopic("passing"));
  station_.Arrive("kept", 1, {}, "a");
  station_.Arrive("kept", 2, {}, "a");
  station_.Arrive("kept", 3, {}, "b");
  station_.Arrive("passing", 4);
  auto subscription = *hub_->Subscribe({});
  EXPECT_EQ(Numbers(*subscription), (std::vector<std::uint64_t>{2, 3}));
  auto without = *hub_->Subscribe({.last = false});
  EXPECT_TRUE(Numbers(*without).empty());
}

TEST_F(TopicHubTest, TellsOfTopicsAndOfSchemasThatComeLater) {
  Make();
  std::vector<std::string> told;
  auto listening =
      hub_->OnTopic([&](const api::TopicInfo& info) { told.push_back(info.topic + info.schema); });
  ircp::RawTopic bare = ScaleTopic();
  bare.schema.clear();
  station_.Appear(bare);
  const std::uint64_t before = hub_->revision();
  station_.Appear(ScaleTopic());
  station_.Appear(ScaleTopic());
  EXPECT_EQ(told, (std::vector<std::string>{"scale", std::string("scale") + kScaleIdl}));
  EXPECT_NE(hub_->revision(), before);
  listening.reset();
  station_.Appear(ScaleTopic("more"));
  EXPECT_EQ(told.size(), 2U);
}

TEST_F(TopicHubTest, CountsLossesByTheNumbersInTheSamples) {
  Make();
  station_.Appear(ScaleTopic());
  for (const std::uint64_t number : {5, 6, 9}) station_.Arrive("scale", 77, ScaleSample(number));
  const auto info = hub_->Find("scale");
  ASSERT_TRUE(info);
  EXPECT_EQ(info->received, 3U);
  EXPECT_EQ(info->lost, 2U);
  EXPECT_EQ(info->writers, 1);
  EXPECT_FALSE(hub_->Find("nothing"));
}

/// A hub whose programs announce what they sent.
class AnnouncedTest : public TopicHubTest {
 protected:
  AnnouncedTest() {
    Make({.decode_status = [this](std::span<const std::uint8_t>) -> Result<ircp::StatusSample> {
      return status_;
    }});
    station_.Appear(ScaleTopic());
    ircp::RawTopic status = ScaleTopic("ircp/scales/status");
    status.type = "exemplar::ircp::v1::Status";
    station_.Appear(status);
  }
  void Announce(std::uint64_t sent, const std::string& participant = "p") {
    status_.sent = {{.topic = "scale", .source = "scale", .sent = sent}};
    station_.Arrive("ircp/scales/status", ++statuses_, {}, participant + "|status");
  }
  std::uint64_t Lost() const { return hub_->Find("scale")->lost; }

  ircp::StatusSample status_;
  std::uint64_t statuses_ = 0;
};

TEST_F(AnnouncedTest, CountsWhatIsLostAtTheEndOnceItsTimeToComeIsOver) {
  for (const std::uint64_t number : {5, 6, 9}) {
    station_.Arrive("scale", 77, ScaleSample(number), "p|scale");
  }
  Announce(12);
  EXPECT_EQ(Lost(), 2U);
  clock_.Advance(milliseconds(999));
  EXPECT_EQ(Lost(), 2U);
  clock_.Advance(milliseconds(1));
  EXPECT_EQ(Lost(), 5U);
  station_.Arrive("scale", 78, ScaleSample(12), "p|scale");
  EXPECT_EQ(Lost(), 4U);
}

TEST_F(AnnouncedTest, HearsProgramsThatAnnounceAllTheTime) {
  station_.Arrive("scale", 1, ScaleSample(1), "p|scale");
  for (std::uint64_t i = 0; i < 100; ++i) {
    Announce(10 + i);
    clock_.Advance(milliseconds(20));
  }
  EXPECT_GE(Lost(), 9U);
  clock_.Advance(milliseconds(1000));
  EXPECT_EQ(Lost(), 108U);
}

TEST_F(AnnouncedTest, TakesAnAnnouncementForTheWriterOfItsProgramThatWasHeardLast) {
  station_.Arrive("scale", 1, ScaleSample(3), "p|before");
  clock_.Advance(milliseconds(10));
  station_.Arrive("scale", 1, ScaleSample(1), "p|now");
  station_.Arrive("scale", 1, ScaleSample(1), "other|scale");
  Announce(4);
  Announce(9, "stranger");
  clock_.Advance(milliseconds(1500));
  EXPECT_EQ(Lost(), 3U);
}

TEST_F(AnnouncedTest, MissesNothingOfAWriterThatItNeverHeard) {
  Announce(40);
  clock_.Advance(milliseconds(1500));
  EXPECT_EQ(Lost(), 0U);
}

TEST_F(TopicHubTest, RefusesMoreSubscriptionsThanItsBound) {
  Make({.max_subscriptions = 2});
  auto first = hub_->Subscribe({});
  auto second = hub_->Subscribe({});
  EXPECT_EQ(hub_->Subscribe({}).error().code, ErrorCode::kResourceExhausted);
  second = hub_->Subscribe({});
  first = Error{};
  EXPECT_TRUE(hub_->Subscribe({}).ok());
}

TEST_F(TopicHubTest, PublishesOnlyWhereItMay) {
  Make({.publish = {"*"}, .known = {ScaleTopic()}});
  for (const char* topic :
       {"ircp/joint_command", "ircp/executor/command", "ircp/executor/status"}) {
    const Status published =
        hub_->Publish({.topic = topic, .type = "lab::Scale", .schema = kScaleIdl, .json = "{}"});
    ASSERT_FALSE(published.ok());
    EXPECT_EQ(published.error().code, ErrorCode::kFailedPrecondition);
  }
  Make({.publish = {"free/*"}});
  EXPECT_EQ(hub_->Publish({.topic = "scale", .json = "{}"}).error().field, "topic");
  EXPECT_EQ(hub_->figures().refused, 1U);
  EXPECT_TRUE(station_.written.empty());
}

TEST_F(TopicHubTest, NumbersAndStampsPublishedSamplesThatSayNothing) {
  Make({.publish = {"scale"}, .known = {ScaleTopic()}, .source = "tablet"});
  ASSERT_TRUE(hub_->Publish({.topic = "scale", .json = R"({"mass_kg":2})"}).ok());
  ASSERT_TRUE(hub_->Publish({.topic = "scale", .json = R"({"mass_kg":3})"}).ok());
  ASSERT_EQ(station_.opened.size(), 1U);
  EXPECT_TRUE(station_.opened[0].keyed);
  const auto type = *dynamic_data::ParseType(kScaleIdl, "lab::Scale");
  const std::string stamp = std::to_string(clock_.Now().nanoseconds());
  EXPECT_EQ(*dynamic_data::ToJson(*type, station_.written[1]),
            R"({"source":"tablet","seq":2,"stamp_ns":)" + stamp + R"(,"mass_kg":3})");
}

TEST_F(TopicHubTest, RefusesSamplesThatAreNotOfTheTopicsType) {
  Make({.publish = {"*"}});
  station_.Appear(ScaleTopic());
  EXPECT_EQ(hub_->Publish({.topic = "scale", .cdr = {0, 1, 0, 0, 9}}).error().field, "cdr");
  EXPECT_EQ(hub_->Publish({.topic = "scale", .json = R"({"mass":1})"}).error().field, "json.mass");
  EXPECT_EQ(hub_->Publish({.topic = "scale", .type = "lab::Other", .cdr = {0}}).error().field,
            "type");
  EXPECT_EQ(hub_->Publish({.topic = "new", .json = "{}"}).error().field, "type");
  EXPECT_EQ(hub_->Publish({.topic = "new", .type = "lab::X", .schema = "struct"}).error().field,
            "schema");
  EXPECT_TRUE(station_.written.empty());
  EXPECT_TRUE(hub_->Publish({.topic = "scale", .cdr = ScaleSample(1)}).ok());
}

TEST_F(TopicHubTest, ServesBatchesWithTopicsAndJson) {
  Make();
  TopicServer server(*hub_, {});
  station_.Appear(ScaleTopic());
  ircp::RawTopic bare = ScaleTopic("bare");
  bare.schema.clear();
  bare.transient_local = true;
  station_.Appear(bare);
  station_.Arrive("bare", 1, {0, 1, 0, 0});
  std::vector<api::TopicBatch> batches;
  const Status served = server.Subscribe({.cdr = false, .json = true},
                                         [&](const api::TopicBatch& batch) {
                                           batches.push_back(batch);
                                           if (batches.size() == 1)
                                             station_.Arrive("scale", 1, ScaleSample(1));
                                           return batches.size() < 2;
                                         },
                                         {});
  ASSERT_TRUE(served.ok());
  ASSERT_EQ(batches.size(), 2U);
  EXPECT_EQ(batches[0].topics.at(0).topic, "bare");
  EXPECT_EQ(batches[0].samples.at(0).json_error, "no writer of the topic brought its schema");
  EXPECT_EQ(batches[1].topics.at(0).schema, kScaleIdl);
  EXPECT_EQ(batches[1].samples.at(0).json,
            R"({"source":"scale","seq":1,"stamp_ns":5,"mass_kg":1.5})");
  EXPECT_TRUE(batches[1].samples.at(0).cdr.empty());
}

}  // namespace
}  // namespace exemplar::gateway
