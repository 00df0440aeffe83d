// The recorder between real DDS participants, told by commands over DDS.

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>

#include "exemplar/bus/codec.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/ircp/control.hpp"
#include "exemplar/recording/file.hpp"
#include "exemplar/recording/reader.hpp"
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

  testing::DdsDomain domain_;
  std::filesystem::path folder_;
};

TEST_F(RecorderDdsTest, RecordsWhatIsSentBetweenStartAndStopWithoutALoss) {
  const auto here = Join();
  const auto there = Join();
  ASSERT_TRUE(here && there);
  const SystemClock clock;
  NullLog log;
  RecorderOptions settings;
  settings.data_dir = folder_;
  auto recorder = Recorder::Create(*here, clock, log, bus::Decode<ircp::StatusSample>, settings);
  ASSERT_TRUE(recorder.ok()) << recorder.error().message;
  auto server = ircp::ControlServer::Create(
      *here, clock, "recorder",
      [&](const ircp::CommandSample& command) { return AnswerCommand(**recorder, command); });
  ASSERT_TRUE(server.ok());

  auto client = ircp::ControlClient::Create(*there, clock, "recorder", "test", 1);
  ASSERT_TRUE(client.ok());
  auto writer = there->MakeWriter<ircp::ObjectSample>("vision");
  ASSERT_TRUE(writer.ok());
  const Result<ircp::Answer> started = (*client)->Call(
      "start", {{"name", "a"}, {"expect", "ircp/objects"}}, std::chrono::seconds(20));
  ASSERT_TRUE(started.ok()) << started.error().message;
  ASSERT_TRUE(Eventually([&] { return (*writer)->matched_readers() > 0; }));
  for (int i = 0; i < kSamples; ++i) ASSERT_TRUE((*writer)->Write(ObjectAt(i)).ok());
  ASSERT_TRUE((*writer)->WaitForAcknowledgments(std::chrono::seconds(20)));
  ASSERT_TRUE(Eventually([&] {
    const Result<api::RecorderStatus> status = (*recorder)->GetStatus();
    for (const api::TopicFigures& topic : status->topics) {
      if (topic.topic == "ircp/objects") return topic.received == kSamples;
    }
    return false;
  }));
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

}  // namespace
}  // namespace exemplar::recorder
