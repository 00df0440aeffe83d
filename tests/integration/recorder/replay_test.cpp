// Record, replay, record again.

#include <gmock/gmock.h>

#include "exemplar/recording/file.hpp"
#include "exemplar/replay/player.hpp"
#include "recorder_fixture.hpp"

namespace exemplar::recorder {
namespace {

/// Brings what a replay sends to the recorder's tap.
class Loopback final : public ircp::RawOutlet {
 public:
  Loopback(LocalRawBus& bus, const Clock& clock) : bus_(bus), clock_(clock) {}
  Result<std::unique_ptr<ircp::RawWriter>> MakeRawWriter(const ircp::RawTopic& topic) override {
    return std::unique_ptr<ircp::RawWriter>(std::make_unique<Writer>(*this, topic.topic));
  }

 private:
  class Writer final : public ircp::RawWriter {
   public:
    Writer(Loopback& network, std::string topic)
        : network_(network), topic_(std::move(topic)), name_("02.bb|" + topic_) {}
    Status Write(std::span<const std::uint8_t> cdr, Stamp source_stamp) override {
      ircp::RawSample sample;
      sample.topic = topic_;
      sample.writer = name_;
      sample.sequence = ++sent_;
      sample.source_stamp = source_stamp;
      sample.received = network_.clock_.Now();
      sample.cdr.assign(cdr.begin(), cdr.end());
      network_.bus_.Deliver(std::move(sample));
      return {};
    }
    int matched_readers() const override { return 1; }
    bool WaitForAcknowledgments(Duration) override { return true; }

   private:
    Loopback& network_;
    const std::string topic_;
    const std::string name_;
    std::uint64_t sent_ = 0;
  };

  LocalRawBus& bus_;
  const Clock& clock_;
};

TEST_F(RecorderTest, RecordsOfAReplayTheSameBytesSchemasSourceTimesAndIntervals) {
  Open();
  MustStart("original");
  for (int i = 0; i < 300; ++i) {
    bus_.Publish(kSuit, "suit", static_cast<std::uint64_t>(i % 7));  // intervals of their own
    if (i % 3 == 0) bus_.Publish("ircp/strange", "x");
  }
  MustStop();
  const FileContent original = ReadFile(PathOf("original"));

  const auto file = recording::FileSource::Open(PathOf("original"));
  ASSERT_TRUE(file.ok());
  Loopback network(bus_, clock_);
  const auto player = replay::Player::Create(**file, network, clock_, {});
  ASSERT_TRUE(player.ok()) << player.error().message;
  MustStart("again");
  ASSERT_TRUE((*player)->Run({}).ok());
  EXPECT_EQ(MustStop().messages, original.messages.size());
  const FileContent again = ReadFile(PathOf("again"));

  ASSERT_EQ(again.messages.size(), original.messages.size());
  // The original's by their times, as they are played.
  std::vector<recording::Message> played = original.messages;
  std::stable_sort(played.begin(), played.end(),
                   [](const auto& a, const auto& b) { return a.log_time < b.log_time; });
  for (std::size_t i = 0; i < played.size(); ++i) {
    const recording::Message& before = played[i];
    const recording::Message& after = again.messages[i];
    EXPECT_EQ(after.data, before.data);
    EXPECT_EQ(after.publish_time, before.publish_time);
    EXPECT_EQ(after.log_time - again.messages[0].log_time, before.log_time - played[0].log_time);
    EXPECT_EQ(again.channels.at(after.channel_id).topic,
              original.channels.at(before.channel_id).topic);
  }
  EXPECT_EQ(again.schemas, original.schemas);
}

}  // namespace
}  // namespace exemplar::recorder
