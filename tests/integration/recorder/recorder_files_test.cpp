#include <gmock/gmock.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>

#include "recorder/control_commands.hpp"
#include "recorder_fixture.hpp"
#include "support/eventually.hpp"

namespace exemplar::recorder {
namespace {

TEST_F(RecorderTest, SplitsBySizeWithEverySampleInExactlyOneFile) {
  settings_.file.compression = recording::Compression::kNone;
  settings_.file.chunk_bytes = 1000;
  Open();
  api::RecordStart start;
  start.name = "long";
  start.split_bytes = 10'000;
  ASSERT_TRUE(recorder_->Start(start).ok());
  constexpr int kSamples = 2000;
  for (int i = 0; i < kSamples; ++i) bus_.Publish(kSuit, "suit");
  const api::RecorderStatus stopped = MustStop();
  EXPECT_EQ(stopped.messages, static_cast<std::uint64_t>(kSamples));
  ASSERT_GT(stopped.part, 3);
  std::int64_t last = 0;
  for (int part = 1; part <= stopped.part; ++part) {
    const std::string number = std::to_string(part);
    const std::string name = "long_" + std::string(4 - number.size(), '0') + number;
    const FileContent file = ReadFile(PathOf(name));
    EXPECT_TRUE(file.closed);
    ASSERT_FALSE(file.messages.empty()) << name;
    for (const recording::Message& message : file.messages) {
      EXPECT_EQ(message.publish_time.nanoseconds(), last + 1000);
      last = message.publish_time.nanoseconds();
    }
    const recording::StringMap& about = *file.Find("exemplar.recording");
    EXPECT_EQ(about.at("part"), number);
    EXPECT_EQ(about.count("previous_file"), part == 1 ? 0u : 1u);
    EXPECT_EQ(about.count("next_file"), part == stopped.part ? 0u : 1u);
  }
  EXPECT_EQ(last, 1000 * kSamples);
  // Its name is taken, split or not.
  EXPECT_EQ(recorder_->Start(start).error().code, ErrorCode::kAlreadyExists);
}

TEST_F(RecorderTest, SplitsByTime) {
  Open();
  api::RecordStart start;
  start.name = "timed";
  start.split_s = 10;
  ASSERT_TRUE(recorder_->Start(start).ok());
  bus_.Publish(kSuit, "suit");
  ASSERT_TRUE(testing::Eventually([&] { return recorder_->GetStatus()->messages == 1; }));
  clock_.Advance(std::chrono::seconds(11));
  bus_.Publish(kSuit, "suit");
  EXPECT_EQ(MustStop().part, 2);
  EXPECT_EQ(ReadFile(PathOf("timed_0001")).messages.size(), 1u);
  EXPECT_EQ(ReadFile(PathOf("timed_0002")).messages.size(), 1u);
}

TEST_F(RecorderTest, AnEventKeepsTheSecondsBeforeItAndCountsTheirLosses) {
  settings_.pre_buffer = std::chrono::seconds(10);
  Open();
  bus_.Publish(kSuit, "suit");  // too old
  clock_.Advance(std::chrono::seconds(30));
  for (int i = 0; i < 5; ++i) {
    bus_.Publish(kSuit, "suit", i == 3 ? 2 : 0);
    clock_.Advance(std::chrono::seconds(1));
  }
  EXPECT_NEAR(recorder_->GetStatus()->buffered_s, 5, 1e-9);
  const auto marked = recorder_->MarkEvent({.note = "stuck", .name = "e", .metadata = {}});
  ASSERT_TRUE(marked.ok()) << marked.error().message;
  EXPECT_EQ(marked->state, "recording");
  bus_.Publish(kSuit, "suit");
  ASSERT_TRUE(recorder_->MarkEvent({.note = "again", .name = "", .metadata = {}}).ok());
  EXPECT_EQ(MustStop().messages, 6u);
  const FileContent file = ReadFile(PathOf("e"));
  ASSERT_EQ(file.messages.size(), 6u);
  EXPECT_EQ(file.messages.front().publish_time, Stamp::FromNanoseconds(2000));
  EXPECT_EQ(file.Find("exemplar.event")->at("note"), "again");
  EXPECT_EQ(file.Find("exemplar.losses")->at("received"), "6");
  EXPECT_EQ(file.Find("exemplar.losses")->at("lost_in_gaps"), "2");
  EXPECT_EQ(std::count_if(file.metadata.begin(), file.metadata.end(),
                          [](const auto& m) { return m.name == "exemplar.event"; }),
            2);
}

TEST_F(RecorderTest, KeepsNoMoreForAnEventThanItMay) {
  settings_.pre_buffer_bytes = 20'000;
  Open();
  for (int i = 0; i < 1000; ++i) bus_.Publish(kSuit, "suit", 0, 200);
  ASSERT_TRUE(recorder_->MarkEvent({.note = "", .name = "e", .metadata = {}}).ok());
  MustStop();
  const FileContent file = ReadFile(PathOf("e"));
  std::size_t bytes = 0;
  for (const recording::Message& message : file.messages) bytes += message.data.size();
  EXPECT_LE(bytes, 20'000u);
  EXPECT_GT(bytes, 15'000u);
  EXPECT_EQ(file.messages.back().publish_time, Stamp::FromNanoseconds(1'000'000));
}

/// Of this process, in bytes.
std::uint64_t ResidentBytes() {
  std::ifstream stream("/proc/self/statm");
  std::uint64_t total = 0;
  std::uint64_t resident = 0;
  stream >> total >> resident;
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

TEST_F(RecorderTest, TakesNoMoreMemoryWhileTheFileGrows) {
  settings_.file.compression = recording::Compression::kNone;
  settings_.file.chunk_bytes = 4096;  // as many index entries as hours of recording have
  settings_.queue_bytes = std::size_t{1} << 20;
  settings_.pre_buffer = Duration(0);
  settings_.flush_interval = std::chrono::milliseconds(4);
  Open();
  MustStart("long");
  const auto grow_to = [&](std::uint64_t bytes) {
    while (true) {
      const api::RecorderStatus status = *recorder_->GetStatus();
      if (status.bytes >= bytes) return;
      for (int i = 0; i < 100; ++i) bus_.Publish(kSuit, "suit", 0, 8192);
      const std::uint64_t sent = bus_.last_seq(kSuit);
      ASSERT_TRUE(testing::Eventually([&] { return recorder_->GetStatus()->messages == sent; }));
    }
  };
  grow_to(20'000'000);
  const std::uint64_t before = ResidentBytes();
  grow_to(240'000'000);
  const std::uint64_t after = ResidentBytes();
  const api::RecorderStatus stopped = MustStop();
  EXPECT_EQ(stopped.lost, 0u);
  EXPECT_GT(stopped.bytes, 220'000'000u);
  EXPECT_LT(after, before + 4'000'000) << "grew while 220 MB were written";
}

TEST_F(RecorderTest, CountsLossesInsideTheFileAndSinceItStarted) {
  Open(120);
  bus_.Publish(kSuit, "suit");
  bus_.Publish(kSuit, "suit", 4);  // lost before the recording: not the file's business
  MustStart("a");
  for (int i = 0; i < 50; ++i) bus_.Publish(kSuit, "suit", i == 20 ? 7 : 0);
  ASSERT_LT(bus_.last_seq(kSuit), 120u);
  const std::uint64_t missing = 120 - bus_.last_seq(kSuit);
  bus_.Publish(kStatus, "capture");
  const api::RecorderStatus stopped = MustStop();
  const FileContent file = ReadFile(PathOf("a"));
  const recording::StringMap* losses = nullptr;
  for (const recording::Metadata& record : file.metadata) {
    if (record.name == "exemplar.losses" && record.metadata.at("topic") == kSuit) {
      losses = &record.metadata;
    }
  }
  ASSERT_NE(losses, nullptr);
  EXPECT_EQ(losses->at("received"), "50");
  EXPECT_EQ(losses->at("lost_in_gaps"), "7");
  EXPECT_EQ(losses->at("lost_at_end"), std::to_string(missing));
  EXPECT_EQ(losses->at("announced"), "120");
  EXPECT_EQ(losses->at("source"), "suit");
  for (const api::TopicFigures& topic : stopped.topics) {
    if (topic.topic != kSuit) continue;
    EXPECT_EQ(topic.sent, 120u);
    EXPECT_EQ(topic.received, 52u);
    EXPECT_EQ(topic.lost, 68u);
    EXPECT_EQ(topic.writers, 1);
    EXPECT_TRUE(topic.has_schema);
  }
}

TEST_F(RecorderTest, CountsWhatAFullQueueDrops) {
  settings_.queue_bytes = 0;
  Open();
  MustStart("a");
  for (int i = 0; i < 30; ++i) bus_.Publish(kSuit, "suit");
  const api::RecorderStatus stopped = MustStop();
  EXPECT_EQ(stopped.messages, 0u);
  EXPECT_EQ(StatusValues(stopped).at("lost"), "30");
  const FileContent file = ReadFile(PathOf("a"));
  EXPECT_EQ(file.Find("exemplar.losses")->at("dropped_by_recorder"), "30");
  EXPECT_EQ(file.Find("exemplar.recording")->at("lost"), "30");
}

TEST_F(RecorderTest, HoldsEverythingOnDiskWithoutAStop) {
  Open();
  MustStart("a");
  for (int i = 0; i < 200; ++i) bus_.Publish(kSuit, "suit");
  // The file as a kill would leave it; the writer's thread needs a moment.
  FileContent file;
  EXPECT_TRUE(exemplar::testing::Eventually([&] {
    clock_.Advance(settings_.flush_interval);
    file = ReadFile(PathOf("a"));
    return file.messages.size() == 200;
  }));
  EXPECT_EQ(file.messages.size(), 200u);
  EXPECT_FALSE(file.closed);
}

TEST_F(RecorderTest, NeverOverwritesARecording) {
  Open();
  MustStart("a");
  MustStop();
  const recording::Bytes before = Slurp(PathOf("a"));
  const auto refused = recorder_->Start({.name = "a", .metadata = {}, .expected_topics = {}});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kAlreadyExists);
  EXPECT_EQ(Slurp(PathOf("a")), before);
  MustStart("b");
}

TEST_F(RecorderTest, StopsWithWhatIsWrittenWhenTheDiskIsFull) {
  settings_.file.chunk_bytes = 4000;
  settings_.file.compression = recording::Compression::kNone;
  Open();
  MustStart("a");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 20'000;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  for (int i = 0; i < 1000; ++i) bus_.Publish(kSuit, "suit", 0, 100);
  const auto stopped = recorder_->Stop();
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, old_handler);

  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::kResourceExhausted);
  const Result<api::RecorderStatus> status = recorder_->GetStatus();
  EXPECT_EQ(status->state, "stopped");
  const FileContent file = ReadFile(PathOf("a"));
  EXPECT_GT(file.messages.size(), 50u);
  for (std::size_t i = 0; i < file.messages.size(); ++i) {
    EXPECT_EQ(file.messages[i].data, SampleBytes("suit", i + 1, 100));
  }
  MustStart("b");
  bus_.Publish(kSuit, "suit");
  EXPECT_EQ(MustStop().messages, 1u);
}

TEST_F(RecorderTest, KeepsIntervalsTrueAndSaysSoWhenTheClockIsSet) {
  Open();
  MustStart("a");
  bus_.Publish(kSuit, "suit");
  clock_.Jump(std::chrono::hours(-1));
  bus_.Publish(kSuit, "suit");
  bus_.Publish(kSuit, "suit");
  clock_.Jump(std::chrono::milliseconds(20));  // no more than a daemon's slewing
  bus_.Publish(kSuit, "suit");
  MustStop();
  const FileContent file = ReadFile(PathOf("a"));
  ASSERT_EQ(file.messages.size(), 4u);
  constexpr std::int64_t kHourNs = 3'600'000'000'000;  // the network's stamps know of no jump here
  EXPECT_EQ(file.messages[0].log_time.nanoseconds(), 1007);
  EXPECT_EQ(file.messages[1].log_time.nanoseconds(), 2007 + kHourNs);
  EXPECT_EQ(file.messages[3].log_time.nanoseconds(), 4007 + kHourNs);
  EXPECT_EQ(file.messages[1].publish_time.nanoseconds(), 2000);
  ASSERT_NE(file.Find("exemplar.clock_jump"), nullptr);
  EXPECT_EQ(file.Find("exemplar.clock_jump")->at("jumps"), "1");
  EXPECT_EQ(file.Find("exemplar.clock_jump")->at("added_to_log_times_s"), "3600.000000000");
  // The next recording begins with the clock as it is then.
  MustStart("b");
  bus_.Publish(kSuit, "suit");
  MustStop();
  EXPECT_EQ(ReadFile(PathOf("b")).messages[0].log_time.nanoseconds(), 5007);
}

TEST_F(RecorderTest, TellsTheSecondOfTwoRecordersThatTheNameIsTaken) {
  Open();
  MustStart("same");
  bus_.Publish(kSuit, "suit");
  LocalRawBus other_bus;
  auto other = Recorder::Create(
      other_bus, clock_, log_,
      [](std::span<const std::uint8_t>) { return Result<ircp::StatusSample>(Internal("unused")); },
      settings_);
  ASSERT_TRUE(other.ok());
  const auto refused = (*other)->Start({.name = "same", .metadata = {}, .expected_topics = {}});
  EXPECT_EQ(refused.error().code, ErrorCode::kAlreadyExists);
  EXPECT_EQ((*other)->GetStatus()->state, "ready");
  EXPECT_EQ(MustStop().messages, 1u);
  EXPECT_TRUE(ReadFile(PathOf("same")).closed);
}

TEST_F(RecorderTest, OutlivesAFolderThatHasGone) {
  Open();
  std::filesystem::remove_all(folder_);
  const auto refused = recorder_->Start({.name = "a", .metadata = {}, .expected_topics = {}});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr(folder_.string()));
  EXPECT_EQ(recorder_->GetStatus()->state, "ready");
  std::filesystem::create_directories(folder_);
  MustStart("a");
  MustStop();
}

}  // namespace
}  // namespace exemplar::recorder
