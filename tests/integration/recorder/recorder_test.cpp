#include <gmock/gmock.h>

#include "recorder/control_commands.hpp"
#include "recorder_fixture.hpp"
#include "support/eventually.hpp"

namespace exemplar::recorder {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST_F(RecorderTest, RecordsEverySampleWithSchemaNumbersAndTimes) {
  Open();
  bus_.Publish(kSuit, "suit");  // before the recording: counted, not recorded
  const auto started = recorder_->Start(
      {.name = "trial-1", .metadata = {{"operator", "Ann"}}, .expected_topics = {kSuit}});
  ASSERT_TRUE(started.ok()) << started.error().message;
  EXPECT_EQ(started->state, "recording");
  EXPECT_EQ(started->file, PathOf("trial-1").string());
  for (int i = 0; i < 100; ++i) bus_.Publish(kSuit, "suit");
  for (int i = 0; i < 10; ++i) bus_.Publish("ircp/strange", "x");
  const api::RecorderStatus stopped = MustStop();
  EXPECT_EQ(stopped.state, "stopped");
  EXPECT_EQ(stopped.messages, 110u);
  EXPECT_EQ(stopped.bytes, std::filesystem::file_size(PathOf("trial-1")));

  const FileContent file = ReadFile(PathOf("trial-1"));
  EXPECT_TRUE(file.closed);
  ASSERT_EQ(file.schemas.size(), 1u);
  EXPECT_EQ(file.schemas[0].name, "exemplar::ircp::v1::Suit");
  EXPECT_EQ(file.schemas[0].encoding, "omgidl");
  EXPECT_EQ(std::string(file.schemas[0].data.begin(), file.schemas[0].data.end()),
            HeaderIdl("Suit"));
  ASSERT_EQ(file.channels.size(), 2u);
  ASSERT_EQ(file.messages.size(), 110u);
  const recording::Message& first = file.messages[0];
  const recording::Channel& channel = file.channels.at(first.channel_id);
  EXPECT_EQ(channel.topic, kSuit);
  EXPECT_EQ(channel.message_encoding, "cdr");
  EXPECT_EQ(channel.schema_id, file.schemas[0].id);
  EXPECT_EQ(channel.metadata.at("source"), "suit");
  EXPECT_EQ(first.data, SampleBytes("suit", 2));
  EXPECT_EQ(first.sequence, 102u);
  EXPECT_EQ(first.publish_time.nanoseconds(), 2000);
  EXPECT_EQ(first.log_time.nanoseconds(), 2007);
  EXPECT_EQ(file.channels.at(file.messages[109].channel_id).schema_id, 0);
  EXPECT_EQ(file.Find("exemplar.trial")->at("operator"), "Ann");
  EXPECT_EQ(file.Find("exemplar.recording")->at("messages"), "110");
  EXPECT_EQ(file.Find("exemplar.recording")->at("station"), "bench");
}

TEST_F(RecorderTest, TellsEveryChangeOfState) {
  Open();
  MustStart("a");
  ASSERT_TRUE(recorder_->Pause().ok());
  ASSERT_TRUE(recorder_->Resume().ok());
  MustStop();
  recorder_->Close();
  EXPECT_THAT(states_,
              ElementsAre("ready", "recording", "paused", "recording", "stopped", "closed"));
  EXPECT_EQ(recorder_->Start({}).error().code, ErrorCode::kFailedPrecondition);
}

TEST_F(RecorderTest, CountsAndMarksPausesInTheFile) {
  Open();
  MustStart("p");
  bus_.Publish(kSuit, "suit");
  for (int pause = 0; pause < 2; ++pause) {
    ASSERT_TRUE(recorder_->Pause().ok());
    for (int i = 0; i < 3; ++i) bus_.Publish(kSuit, "suit");
    ASSERT_TRUE(recorder_->Resume().ok());
  }
  const api::RecorderStatus stopped = MustStop();
  EXPECT_EQ(stopped.pauses, 2);
  EXPECT_EQ(stopped.left_out, 6u);
  const FileContent file = ReadFile(PathOf("p"));
  EXPECT_EQ(file.messages.size(), 1u);
  EXPECT_EQ(file.Find("exemplar.pause")->at("pauses"), "2");
  EXPECT_EQ(file.Find("exemplar.resume")->at("left_out"), "6");
  EXPECT_EQ(file.Find("exemplar.recording")->at("left_out"), "6");
}

TEST_F(RecorderTest, IsReadyOnceTheExpectedWritersAreThere) {
  settings_.expected_topics = {kSuit};
  settings_.schema_of = [](const std::string& type) {
    return type == "lab::Reading" ? "module lab { struct Reading { long x; }; };" : "";
  };
  auto made = Recorder::Create(
      bus_, clock_, log_,
      [](std::span<const std::uint8_t>) {
        return Result<ircp::StatusSample>(ircp::StatusSample());
      },
      settings_);
  ASSERT_TRUE(made.ok());
  recorder_ = std::move(*made);
  EXPECT_EQ(recorder_->GetStatus()->state, "closed");
  api::RecordStart start;
  start.timeout_s = 0.1;
  EXPECT_EQ(recorder_->Start(start).error().code, ErrorCode::kDeadlineExceeded);
  bus_.AddWriter(kSuit, "exemplar::ircp::v1::Suit", HeaderIdl("Suit"));
  bus_.AddWriter("ircp/strange", "lab::Reading", "");
  ASSERT_TRUE(testing::Eventually([&] { return recorder_->GetStatus()->state == "ready"; }));
  MustStart("s");
  bus_.Publish("ircp/strange", "x");
  MustStop();
  const FileContent file = ReadFile(PathOf("s"));
  ASSERT_EQ(file.schemas.size(), 1u);  // from the folder
  EXPECT_EQ(file.schemas[0].name, "lab::Reading");
}

TEST_F(RecorderTest, WritesNothingWhilePaused) {
  Open();
  MustStart("a");
  for (int i = 0; i < 10; ++i) bus_.Publish(kSuit, "suit");
  clock_.Advance(std::chrono::seconds(2));
  ASSERT_TRUE(recorder_->Pause().ok());
  for (int i = 0; i < 5; ++i) bus_.Publish(kSuit, "suit");
  clock_.Advance(std::chrono::seconds(60));
  ASSERT_TRUE(recorder_->Resume().ok());
  for (int i = 0; i < 10; ++i) bus_.Publish(kSuit, "suit");
  const api::RecorderStatus stopped = MustStop();
  EXPECT_EQ(stopped.messages, 20u);
  EXPECT_NEAR(stopped.duration_s, 2, 0.1);
  EXPECT_EQ(ReadFile(PathOf("a")).Find("exemplar.recording")->at("lost"), "0");
}

TEST_F(RecorderTest, WaitsForExpectedWritersAndNamesThoseThatNeverCame) {
  Open();
  const auto refused = recorder_->Start(
      {.name = "a", .metadata = {}, .expected_topics = {kSuit, "ircp/tactile"}, .timeout_s = 2});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kDeadlineExceeded);
  EXPECT_EQ(refused.error().message, "no writer of ircp/tactile after 2 s");
  EXPECT_EQ(recorder_->GetStatus()->state, "ready");
  EXPECT_FALSE(std::filesystem::exists(PathOf("a")));
  bus_.AddWriter("ircp/tactile", "exemplar::ircp::v1::Tactile", HeaderIdl("Tactile"));
  EXPECT_TRUE(
      recorder_->Start({.name = "a", .metadata = {}, .expected_topics = {"ircp/tactile"}}).ok());
}

TEST_F(RecorderTest, RefusesNamesThatAreNoFileNames) {
  Open();
  for (const std::string name : {"../a", "a/b", ".a", "a b", std::string(300, 'a').c_str()}) {
    const auto refused = recorder_->Start({.name = name, .metadata = {}, .expected_topics = {}});
    ASSERT_FALSE(refused.ok()) << name;
    EXPECT_EQ(refused.error().field, "name");
  }
  const auto unnamed = recorder_->Start({});
  ASSERT_TRUE(unnamed.ok());
  EXPECT_THAT(std::filesystem::path(unnamed->file).filename().string(), StartsWith("20231114T"));
}

TEST_F(RecorderTest, ClosesTheFileWhenItGoes) {
  Open();
  MustStart("a");
  for (int i = 0; i < 20; ++i) bus_.Publish(kSuit, "suit");
  recorder_.reset();
  const FileContent file = ReadFile(PathOf("a"));
  EXPECT_TRUE(file.closed);
  EXPECT_EQ(file.messages.size(), 20u);
}

TEST_F(RecorderTest, NamesAFolderThatCannotBeMade) {
  std::ofstream(folder_ / "file") << "x";
  settings_.data_dir = folder_ / "file" / "below";
  const auto made = Recorder::Create(
      bus_, clock_, log_,
      [](std::span<const std::uint8_t>) { return Result<ircp::StatusSample>(Internal("unused")); },
      settings_);
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error().field, "data_dir");
  EXPECT_THAT(made.error().message, HasSubstr("below"));
}

TEST_F(RecorderTest, AnswersCommandsOfTheNetwork) {
  Open();
  ircp::CommandSample command;
  command.action = "start";
  command.arguments = {{"name", "a"}, {"meta.operator", "Ann"}, {"source", "x.csv"}};
  ircp::Answer answer = AnswerCommand(*recorder_, command);
  ASSERT_TRUE(answer.ok) << answer.detail;
  EXPECT_EQ(answer.values.at("file"), PathOf("a").string());
  bus_.Publish(kSuit, "suit");
  command.action = "stop";
  answer = AnswerCommand(*recorder_, command);
  ASSERT_TRUE(answer.ok) << answer.detail;
  EXPECT_EQ(answer.values.at("messages"), "1");
  EXPECT_EQ(answer.values.at("lost"), "0");
  const FileContent file = ReadFile(PathOf("a"));
  EXPECT_EQ(file.Find("exemplar.trial")->at("operator"), "Ann");
  EXPECT_EQ(file.Find("exemplar.trial")->at("source"), "x.csv");

  command.action = "dance";
  answer = AnswerCommand(*recorder_, command);
  EXPECT_FALSE(answer.ok);
  EXPECT_THAT(answer.detail, HasSubstr("\"dance\" is unknown"));
  command.action = "pause";
  EXPECT_EQ(AnswerCommand(*recorder_, command).values.at("error"), "failed_precondition");
  command.action = "start";
  command.arguments = {{"timeout_s", "soon"}};
  EXPECT_THAT(AnswerCommand(*recorder_, command).detail, HasSubstr("\"soon\" is not a number"));
}

}  // namespace
}  // namespace exemplar::recorder
