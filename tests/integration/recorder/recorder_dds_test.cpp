// The recorder between real DDS participants, told by commands over DDS.

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>

#include "exemplar/bus/codec.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/ircp/control.hpp"
#include "exemplar/recording/file.hpp"
#include "exemplar/recording/reader.hpp"
#include "exemplar/replay/player.hpp"
#include "recorder/control_commands.hpp"
#include "recorder/recorder.hpp"
#include "support/dds_domain.hpp"
#include "support/eventually.hpp"

namespace exemplar::recorder {
namespace {

using testing::Eventually;

constexpr int kSamples = 1000;

ircp::ObjectSample ObjectAt(int i) {
  ircp::ObjectSample sample;
  sample.name = i % 2 == 0 ? "button" : "lid";
  sample.frame = "base";
  sample.base_T_object.translation = {0.001 * i, 0.2, 0.3};
  return sample;
}

class RecorderDdsTest : public ::testing::Test {
 protected:
  RecorderDdsTest() {
    std::string name = (std::filesystem::temp_directory_path() / "exemplar-dds-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~RecorderDdsTest() override { std::filesystem::remove_all(folder_); }

  std::unique_ptr<bus::Participant> Join() {
    bus::ParticipantOptions options;
    options.domain = domain_.number();
    options.station = "bench";
    Result<std::unique_ptr<bus::Participant>> joined = bus::Participant::Create(options);
    EXPECT_TRUE(joined.ok());
    return joined.ok() ? std::move(*joined) : nullptr;
  }

  std::unique_ptr<Recorder> Record(bus::Participant& station) {
    RecorderOptions settings;
    settings.data_dir = folder_;
    auto made = Recorder::Create(station, clock_, log_, bus::Decode<ircp::StatusSample>, settings);
    EXPECT_TRUE(made.ok());
    return made.ok() ? std::move(*made) : nullptr;
  }

  /// True once the recorder has got so many of the objects.
  static bool HasObjects(Recorder& recorder, std::uint64_t count) {
    return Eventually([&] {
      const Result<api::RecorderStatus> status = recorder.GetStatus();
      for (const api::TopicFigures& topic : status->topics) {
        if (topic.topic == "ircp/objects") return topic.received == count;
      }
      return false;
    });
  }

  static std::vector<recording::Message> Objects(const std::filesystem::path& file) {
    std::vector<recording::Message> messages;
    auto source = recording::FileSource::Open(file);
    if (!source.ok()) return messages;
    auto reader = recording::IndexedReader::Open(**source);
    if (!reader.ok()) return messages;
    EXPECT_TRUE((*reader)
                    ->ReadMessages({.topics = {"ircp/objects"}, .start = {}, .end = {}},
                                   [&](const recording::Message& message) {
                                     messages.push_back(message);
                                     return true;
                                   })
                    .ok());
    return messages;
  }

  testing::DdsDomain domain_;
  std::filesystem::path folder_;
  const SystemClock clock_;
  NullLog log_;
};

TEST_F(RecorderDdsTest, RecordsWhatIsSentBetweenStartAndStopWithoutALoss) {
  const auto here = Join();
  const auto there = Join();
  ASSERT_TRUE(here && there);
  const auto recorder = Record(*here);
  ASSERT_NE(recorder, nullptr);
  auto server = ircp::ControlServer::Create(
      *here, clock_, "recorder",
      [&](const ircp::CommandSample& command) { return AnswerCommand(*recorder, command); });
  ASSERT_TRUE(server.ok());

  auto client = ircp::ControlClient::Create(*there, clock_, "recorder", "test", 1);
  ASSERT_TRUE(client.ok());
  auto writer = there->MakeWriter<ircp::ObjectSample>("vision");
  ASSERT_TRUE(writer.ok());
  const Result<ircp::Answer> started = (*client)->Call(
      "start", {{"name", "a"}, {"expect", "ircp/objects"}}, std::chrono::seconds(20));
  ASSERT_TRUE(started.ok()) << started.error().message;
  ASSERT_TRUE(Eventually([&] { return (*writer)->matched_readers() > 0; }));
  for (int i = 0; i < kSamples; ++i) ASSERT_TRUE((*writer)->Write(ObjectAt(i)).ok());
  ASSERT_TRUE((*writer)->WaitForAcknowledgments(std::chrono::seconds(20)));
  ASSERT_TRUE(HasObjects(*recorder, kSamples));
  const Result<ircp::Answer> stopped = (*client)->Call("stop", {}, std::chrono::seconds(20));
  ASSERT_TRUE(stopped.ok()) << stopped.error().message;
  EXPECT_EQ(stopped->values.at("state"), "stopped");

  auto source = recording::FileSource::Open(stopped->values.at("file"));
  ASSERT_TRUE(source.ok()) << source.error().message;
  auto reader = recording::IndexedReader::Open(**source);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  int i = 0;
  const Status read = (*reader)->ReadMessages(
      {.topics = {"ircp/objects"}, .start = {}, .end = {}}, [&](const recording::Message& message) {
        const Result<ircp::ObjectSample> sample = bus::Decode<ircp::ObjectSample>(message.data);
        EXPECT_TRUE(sample.ok());
        if (!sample.ok()) return false;
        EXPECT_EQ(sample->header.seq, static_cast<std::uint64_t>(i + 1));
        EXPECT_EQ(sample->header.source, "vision");
        EXPECT_EQ(sample->name, ObjectAt(i).name);
        EXPECT_EQ(sample->base_T_object.translation, ObjectAt(i).base_T_object.translation);
        ++i;
        return true;
      });
  EXPECT_TRUE(read.ok());
  EXPECT_EQ(i, kSamples);
  for (const auto& [id, channel] : (*reader)->channels()) {
    if (channel.topic != "ircp/objects") continue;
    const recording::Schema& schema = (*reader)->schemas().at(channel.schema_id);
    EXPECT_EQ(schema.name, bus::TypeNameOf<ircp::ObjectSample>());
    EXPECT_EQ(std::string(schema.data.begin(), schema.data.end()),
              bus::SchemaOf<ircp::ObjectSample>());
  }
}

TEST_F(RecorderDdsTest, RecordsOfAReplayTheSameBytesAndSourceTimes) {
  const auto here = Join();
  const auto there = Join();
  ASSERT_TRUE(here && there);
  const auto recorder = Record(*here);
  ASSERT_NE(recorder, nullptr);
  auto writer = there->MakeWriter<ircp::ObjectSample>("vision");
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE(Eventually([&] { return (*writer)->matched_readers() > 0; }));
  ASSERT_TRUE(recorder->Start({.name = "original", .metadata = {}, .expected_topics = {}}).ok());
  for (int i = 0; i < kSamples; ++i) ASSERT_TRUE((*writer)->Write(ObjectAt(i)).ok());
  ASSERT_TRUE(HasObjects(*recorder, kSamples));
  ASSERT_TRUE(recorder->Stop().ok());
  writer->reset();

  auto file = recording::FileSource::Open(folder_ / "original.mcap");
  ASSERT_TRUE(file.ok());
  const auto stage = Join();
  auto player = replay::Player::Create(**file, *stage, clock_, {});
  ASSERT_TRUE(player.ok()) << player.error().message;
  ASSERT_TRUE(Eventually([&] { return (*player)->UnreadTopics().empty(); }));
  ASSERT_TRUE(recorder->Start({.name = "again", .metadata = {}, .expected_topics = {}}).ok());
  ASSERT_TRUE((*player)->Run({}).ok());
  EXPECT_EQ((*player)->status().sent, static_cast<std::uint64_t>(kSamples));
  ASSERT_TRUE((*player)->WaitForAcknowledgments(std::chrono::seconds(20)));
  ASSERT_TRUE(HasObjects(*recorder, 2 * kSamples));
  ASSERT_TRUE(recorder->Stop().ok());

  const std::vector<recording::Message> original = Objects(folder_ / "original.mcap");
  const std::vector<recording::Message> again = Objects(folder_ / "again.mcap");
  ASSERT_EQ(original.size(), static_cast<std::size_t>(kSamples));
  ASSERT_EQ(again.size(), original.size());
  // The middleware's own stamps, where nobody gave others.
  EXPECT_LT(std::chrono::abs(original[0].publish_time - original[0].log_time),
            std::chrono::minutes(1));
  for (std::size_t i = 0; i < original.size(); ++i) {
    EXPECT_EQ(again[i].data, original[i].data);
    EXPECT_EQ(again[i].publish_time, original[i].publish_time);
    EXPECT_GT(again[i].log_time, original[i].log_time);
  }
}

}  // namespace
}  // namespace exemplar::recorder
