#include "recorder/recorder.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <mutex>

#include "cdr.hpp"
#include "exemplar/base/rng.hpp"
#include "exemplar/recording/file.hpp"
#include "exemplar/recording/recover.hpp"
#include "recorder/control_commands.hpp"
#include "support/eventually.hpp"

namespace exemplar::recorder {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr const char* kSuit = "ircp/suit";
constexpr const char* kStatus = "ircp/capture/status";

/// A network of one process: what a test publishes is what the recorder's tap gets.
class LocalRawBus final : public ircp::RawBus {
 public:
  Result<std::unique_ptr<ircp::RawTap>> MakeTap(ircp::RawTapOptions options) override {
    options_ = std::move(options);
    return std::unique_ptr<ircp::RawTap>(std::make_unique<Tap>(*this));
  }

  void AddWriter(const std::string& name, const std::string& type, const std::string& schema) {
    ircp::RawTopic topic;
    topic.topic = name;
    topic.type = type;
    topic.schema = schema;
    if (!options_.wanted(topic)) return;
    {
      const std::lock_guard lock(mutex_);
      ++writers_[name];
    }
    options_.on_topic(topic);
  }

  /// Numbers count on for each topic; `skip` of them never arrive.
  void Publish(const std::string& topic, const std::string& source, std::uint64_t skip = 0,
               std::size_t extra = 8) {
    const std::uint64_t seq = (last_seq_[topic] += 1 + skip);
    ircp::RawSample sample;
    sample.topic = topic;
    sample.writer = "01.aa|" + topic;
    sample.sequence = seq + 100;
    sample.source_stamp = Stamp::FromNanoseconds(static_cast<std::int64_t>(1000 * seq));
    sample.received = Stamp::FromNanoseconds(static_cast<std::int64_t>(1000 * seq + 7));
    sample.cdr = SampleBytes(source, seq, extra);
    options_.on_sample(std::move(sample));
  }
  std::uint64_t last_seq(const std::string& topic) { return last_seq_[topic]; }

 private:
  class Tap final : public ircp::RawTap {
   public:
    explicit Tap(LocalRawBus& bus) : bus_(bus) {}
    std::vector<ircp::RawTopic> topics() const override { return {}; }
    int matched_writers(const std::string& topic) const override {
      const std::lock_guard lock(bus_.mutex_);
      const auto found = bus_.writers_.find(topic);
      return found == bus_.writers_.end() ? 0 : found->second;
    }

   private:
    LocalRawBus& bus_;
  };

  ircp::RawTapOptions options_;
  std::mutex mutex_;
  std::map<std::string, int> writers_;
  std::map<std::string, std::uint64_t> last_seq_;
};

/// Time passes only where somebody waits for it or a test says so.
class PatientClock final : public Clock {
 public:
  Stamp Now() const override { return Stamp::FromNanoseconds(steady_ + 1'700'000'000'000'000'000); }
  Duration Steady() const override { return Duration(steady_.load()); }
  bool SleepUntil(Duration steady, std::stop_token) const override {
    steady_ = std::max(steady_.load(), steady.count());
    return true;
  }
  void Advance(Duration d) const { steady_ += d.count(); }

 private:
  mutable std::atomic<std::int64_t> steady_{0};
};

recording::Bytes Slurp(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return recording::Bytes(std::istreambuf_iterator<char>(stream), {});
}

struct FileContent {
  std::vector<recording::Schema> schemas;
  std::map<std::uint16_t, recording::Channel> channels;
  std::vector<recording::Message> messages;
  std::vector<recording::Metadata> metadata;
  bool closed = false;

  const recording::StringMap* Find(const std::string& name) const {
    const recording::StringMap* last = nullptr;
    for (const recording::Metadata& record : metadata) {
      if (record.name == name) last = &record.metadata;
    }
    return last;
  }
};

/// Whatever a file holds, closed or not.
FileContent ReadFile(const std::filesystem::path& path) {
  const recording::Bytes bytes = Slurp(path);
  recording::MemorySource damaged(bytes);
  recording::MemorySink whole;
  const Result<recording::RecoveryReport> report = recording::Recover(damaged, whole);
  EXPECT_TRUE(report.ok()) << report.error().message;
  FileContent content;
  if (!report.ok()) return content;
  content.closed = report->was_whole;
  recording::MemorySource source(whole.bytes());
  auto reader = recording::StreamReader::Create(source);
  EXPECT_TRUE(reader.ok());
  bool in_data = true;
  while (true) {
    Result<std::optional<recording::Record>> record = (*reader)->Next();
    EXPECT_TRUE(record.ok()) << record.error().message;
    if (!record.ok() || !record->has_value()) return content;
    recording::Record& r = **record;
    if (std::holds_alternative<recording::DataEnd>(r)) in_data = false;
    if (!in_data) continue;
    if (auto* schema = std::get_if<recording::Schema>(&r)) content.schemas.push_back(*schema);
    if (auto* channel = std::get_if<recording::Channel>(&r))
      content.channels[channel->id] = *channel;
    if (auto* message = std::get_if<recording::Message>(&r)) content.messages.push_back(*message);
    if (auto* metadata = std::get_if<recording::Metadata>(&r))
      content.metadata.push_back(*metadata);
  }
}

class RecorderTest : public ::testing::Test {
 protected:
  RecorderTest() {
    std::string name =
        (std::filesystem::temp_directory_path() / "exemplar-recorder-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    settings_.data_dir = folder_;
    settings_.station = "bench";
    settings_.on_change = [this](const std::string& state, const std::string&) {
      const std::lock_guard lock(states_mutex_);
      states_.push_back(state);
    };
  }
  ~RecorderTest() override {
    recorder_.reset();
    std::filesystem::remove_all(folder_);
  }

  /// `announced`: what every status sample says of kSuit.
  void Open(std::uint64_t announced = 0) {
    const StatusDecoder decode = [announced](std::span<const std::uint8_t>) {
      ircp::StatusSample status;
      if (announced > 0) status.sent = {{kSuit, "suit", announced}};
      return Result<ircp::StatusSample>(status);
    };
    Result<std::unique_ptr<Recorder>> made =
        Recorder::Create(bus_, clock_, log_, decode, settings_);
    ASSERT_TRUE(made.ok()) << made.error().message;
    recorder_ = std::move(*made);
    bus_.AddWriter(kSuit, "exemplar::ircp::v1::Suit", HeaderIdl("Suit"));
    bus_.AddWriter(kStatus, "exemplar::ircp::v1::Status", HeaderIdl("Status"));
    bus_.AddWriter("ircp/strange", "lab::Reading", "");
    bus_.AddWriter("rosout", "rcl::Log", "struct Log {};");
  }

  void MustStart(const std::string& name) {
    const auto started = recorder_->Start({.name = name, .metadata = {}, .expected_topics = {}});
    ASSERT_TRUE(started.ok()) << started.error().message;
  }
  api::RecorderStatus MustStop() {
    const auto stopped = recorder_->Stop();
    EXPECT_TRUE(stopped.ok()) << stopped.error().message;
    return stopped.ok() ? *stopped : api::RecorderStatus();
  }
  std::filesystem::path PathOf(const std::string& name) const { return folder_ / (name + ".mcap"); }

  std::filesystem::path folder_;
  LocalRawBus bus_;
  PatientClock clock_;
  NullLog log_;
  RecorderOptions settings_;
  std::mutex states_mutex_;
  std::vector<std::string> states_;
  std::unique_ptr<Recorder> recorder_;
};

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
