#include "exemplar/bus/mcap_trial.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "exemplar/bus/codec.hpp"
#include "exemplar/ircp/clock_relation.hpp"
#include "exemplar/ircp/trial_player.hpp"
#include "exemplar/recording/writer.hpp"

namespace exemplar::bus {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

/// Writes recordings as the recorder does: a channel for each topic and writer.
class Recording {
 public:
  Recording() { writer_ = std::move(*recording::Writer::Create(sink_)); }

  template <class Sample>
  void Add(Sample sample, std::uint64_t seq, const std::string& writer = "w1") {
    sample.header.source = "source";
    sample.header.seq = seq;
    AddBytes(Sample::kTopic, std::string(TypeNameOf<Sample>()), Encode(sample), writer);
  }

  void AddBytes(const std::string& topic, const std::string& type,
                const std::vector<std::uint8_t>& bytes, const std::string& writer = "w1",
                Stamp received = Stamp()) {
    auto [known, added] = channels_.try_emplace({topic, writer}, next_);
    if (added) {
      recording::Schema schema{next_, type, "omgidl", {'x'}};
      ASSERT_TRUE(writer_->AddSchema(schema).ok());
      recording::Channel channel{next_, next_, topic, "cdr", {{"writer", writer}}};
      ASSERT_TRUE(writer_->AddChannel(channel).ok());
      ++next_;
    }
    recording::Message message;
    message.channel_id = known->second;
    message.log_time = received;
    message.data = bytes;
    ASSERT_TRUE(writer_->Write(message).ok());
  }

  void AddMetadata(const recording::Metadata& metadata) {
    ASSERT_TRUE(writer_->Write(metadata).ok());
  }

  std::string Bytes() {
    EXPECT_TRUE(writer_->Close().ok());
    return {sink_.bytes().begin(), sink_.bytes().end()};
  }

 private:
  recording::MemorySink sink_;
  std::unique_ptr<recording::Writer> writer_;
  std::map<std::pair<std::string, std::string>, std::uint16_t> channels_;
  std::uint16_t next_ = 1;
};

demonstration::Trial Reaching() {
  demonstration::Trial trial;
  demonstration::PoseSeries hand;
  demonstration::PoseSeries button;
  button.name = "button";
  button.has_orientation = false;
  for (int i = 0; i < 20; ++i) {
    hand.time_s.push_back(i / 100.0);
    hand.base_T_frame.push_back(geometry::Pose::FromTranslation({0.01 * i, 0.5, 0.3}));
    if (i % 10 == 0) {
      button.time_s.push_back(i / 100.0);
      button.base_T_frame.push_back(geometry::Pose::FromTranslation({0.2, 0.5, 0.1}));
    }
  }
  trial.end_effectors = {hand};
  trial.objects = {button};
  return trial;
}

ircp::EndEffectorSample Tool(int i) {
  ircp::EndEffectorSample sample;
  sample.header.stamp = Stamp::FromNanoseconds(1'000'000 * (i + 1));
  return sample;
}

TEST(ReadTrialFromMcapTest, ReadsBackWhatWasRecorded) {
  const demonstration::Trial trial = Reaching();
  Recording recording;
  std::map<std::size_t, std::uint64_t> seq;
  for (const ircp::TrialSample& sample :
       ircp::SamplesOf(trial, Stamp::FromNanoseconds(1'700'000'000'000'000'000)).samples) {
    const std::uint64_t number = ++seq[sample.index()];
    std::visit([&](const auto& s) { recording.Add(s, number); }, sample);
  }
  const auto read = ReadTrialFromMcap(recording.Bytes(), "reach.mcap");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_TRUE(demonstration::SameContent(trial, *read));
  EXPECT_EQ(read->source, "reach.mcap");
  EXPECT_EQ(read->start, Stamp::FromNanoseconds(1'700'000'000'000'000'000));
  EXPECT_TRUE(read->notices.empty());
}

TEST(ReadTrialFromMcapTest, CountsLossesAndDropsWhatStandsTwice) {
  Recording recording;
  for (const int i : {1, 2, 2, 5, 6, 1}) {
    recording.Add(Tool(i), static_cast<std::uint64_t>(i));
  }
  // The recorder repeats its figures; the last ones count.
  for (const char* at_end : {"1", "4"}) {
    recording.AddMetadata(
        {"exemplar.losses",
         {{"topic", "ircp/end_effector"}, {"writer", "w1"}, {"lost_at_end", at_end}}});
  }
  const auto read = ReadTrialFromMcap(recording.Bytes(), "t.mcap");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->end_effectors[0].size(), 4u);
  EXPECT_THAT(read->notices, Contains("ircp/end_effector: 6 samples lost"));
  EXPECT_THAT(read->notices, Contains("ircp/end_effector: 2 samples stood twice"));
}

TEST(ReadTrialFromMcapTest, TellsTheLabelsThatWereWrittenLast) {
  Recording recording;
  recording.Add(Tool(1), 1);
  recording.Add(Tool(2), 2);
  recording.AddMetadata({"exemplar.labels", {{"success", "no"}, {"phase", "press"}}});
  recording.AddMetadata({"exemplar.labels", {{"success", "yes"}}});
  const auto read = ReadTrialFromMcap(recording.Bytes(), "t.mcap");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->notices, std::vector<std::string>{"label success: yes"});
}

TEST(ReadTrialFromMcapTest, KeepsSamplesOfAWriterThatWasStartedAgain) {
  Recording recording;
  recording.Add(Tool(1), 1, "w1");
  recording.Add(Tool(2), 2, "w1");
  recording.Add(Tool(3), 1, "w2");
  recording.Add(Tool(4), 2, "w2");
  const auto read = ReadTrialFromMcap(recording.Bytes(), "t.mcap");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->end_effectors[0].size(), 4u);
  EXPECT_TRUE(read->notices.empty());
}

TEST(ReadTrialFromMcapTest, LeavesStrangersAloneAndSaysSo) {
  Recording recording;
  recording.Add(Tool(1), 1);
  recording.Add(Tool(2), 2);
  recording.AddBytes("rt/scan", "sensor_msgs::msg::dds_::LaserScan_", {1, 2, 3});
  recording.AddBytes("ircp/camera", "exemplar::ircp::v1::Camera", {1, 2, 3});
  const auto read = ReadTrialFromMcap(recording.Bytes(), "t.mcap");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->notices, std::vector<std::string>{"rt/scan: not a topic of ours, left alone"});
}

TEST(ReadTrialFromMcapTest, NamesTheChannelOfASampleItCannotRead) {
  Recording cut;
  cut.Add(Tool(1), 1);
  cut.AddBytes("ircp/end_effector", "", {0, 1, 0, 0, 9});
  const auto damaged = ReadTrialFromMcap(cut.Bytes(), "cut.mcap");
  ASSERT_FALSE(damaged.ok());
  EXPECT_THAT(damaged.error().message,
              HasSubstr("cut.mcap: channel ircp/end_effector, message 2: "));

  Recording other;
  other.AddBytes("ircp/suit", "exemplar::ircp::v9::Suit", {0, 1, 0, 0, 9});
  const auto version = ReadTrialFromMcap(other.Bytes(), "new.mcap");
  ASSERT_FALSE(version.ok());
  EXPECT_THAT(version.error().message, HasSubstr("v9::Suit"));
}

TEST(ReadTrialFromMcapTest, RefusesWhatIsNoWholeRecording) {
  EXPECT_FALSE(ReadTrialFromMcap("", "empty.mcap").ok());
  EXPECT_FALSE(ReadTrialFromMcap("time_s,ee_x_m\n", "t.csv").ok());
  Recording recording;
  for (int i = 1; i < 50; ++i) recording.Add(Tool(i), static_cast<std::uint64_t>(i));
  const std::string bytes = recording.Bytes();
  for (std::size_t length = 0; length < bytes.size(); length += 7) {
    const auto cut = ReadTrialFromMcap(std::string_view(bytes).substr(0, length), "cut.mcap");
    ASSERT_FALSE(cut.ok()) << length;
    EXPECT_THAT(cut.error().message, HasSubstr("cut.mcap"));
  }
  Recording nothing;
  nothing.AddBytes("rt/scan", "x", {1});
  EXPECT_FALSE(ReadTrialFromMcap(nothing.Bytes(), "nothing.mcap").ok());
}

TEST(ReadTrialFromMcapTest, BringsTheStampsOfAnotherMachinesClockOntoTheRecorders) {
  const Stamp start = Stamp::FromNanoseconds(1'700'000'000'000'000'000);
  Recording recording;
  // The suit's machine is 7 s ahead and gains 100 parts in a million; the camera's is the
  // recorder's.
  const auto shown = [&](double t) { return start + FromSeconds(t + 7 + 1e-4 * t); };
  for (int i = 0; i < 50; ++i) {
    const double t = 0.1 * i;
    ircp::EndEffectorSample tool;
    tool.header = {.source = "suit", .seq = static_cast<std::uint64_t>(i + 1), .stamp = shown(t)};
    recording.AddBytes("ircp/end_effector", std::string(TypeNameOf<ircp::EndEffectorSample>()),
                       Encode(tool), "aa|1", start + FromSeconds(t + 0.002));
    ircp::ObjectSample object;
    object.header = {.source = "camera",
                     .seq = static_cast<std::uint64_t>(i + 1),
                     .stamp = start + FromSeconds(t)};
    object.name = "button";
    recording.AddBytes("ircp/objects", std::string(TypeNameOf<ircp::ObjectSample>()),
                       Encode(object), "bb|1", start + FromSeconds(t + 0.002));
  }
  for (const double t : {0.0, 5.0}) {
    recording.AddMetadata(
        {"exemplar.clock", ircp::ToFields({.participant = "aa",
                                           .program = "capture_suit",
                                           .observer = "cc",
                                           .at = start + FromSeconds(t),
                                           .offset = shown(t) - (start + FromSeconds(t)),
                                           .drift = 1e-4,
                                           .uncertainty = std::chrono::microseconds(100),
                                           .since = start})});
    recording.AddMetadata(
        {"exemplar.clock", ircp::ToFields({.participant = "bb",
                                           .program = "capture_vision",
                                           .observer = "cc",
                                           .at = start + FromSeconds(t),
                                           .offset = std::chrono::microseconds(80),
                                           .uncertainty = std::chrono::microseconds(100),
                                           .since = start})});
  }
  const auto trial = ReadTrialFromMcap(recording.Bytes(), "t.mcap");
  ASSERT_TRUE(trial.ok()) << trial.error().message;
  const std::vector<double>& tool_s = trial->end_effectors.at(0).time_s;
  const std::vector<double>& button_s = trial->objects.at(0).time_s;
  ASSERT_EQ(tool_s.size(), 50U);
  ASSERT_EQ(button_s.size(), 50U);
  for (std::size_t i = 0; i < 50; ++i) EXPECT_NEAR(tool_s[i], button_s[i], 1e-6);
  EXPECT_THAT(trial->notices, Contains(HasSubstr("clock of capture_suit: 7.0005")));
}

}  // namespace
}  // namespace exemplar::bus
