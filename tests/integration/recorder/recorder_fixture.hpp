#pragma once
// A recorder on a network of one process and a clock of the test's, and what its files hold.

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "cdr.hpp"
#include "exemplar/recording/recover.hpp"
#include "recorder/recorder.hpp"
#include "support/patient_clock.hpp"

namespace exemplar::recorder {

inline constexpr const char* kSuit = "ircp/suit";
inline constexpr const char* kStatus = "ircp/capture/status";

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
    Deliver(std::move(sample));
  }
  void Deliver(ircp::RawSample sample) { options_.on_sample(std::move(sample)); }
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
inline recording::Bytes Slurp(const std::filesystem::path& path) {
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
inline FileContent ReadFile(const std::filesystem::path& path) {
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
  testing::PatientClock clock_;
  NullLog log_;
  RecorderOptions settings_;
  std::mutex states_mutex_;
  std::vector<std::string> states_;
  std::unique_ptr<Recorder> recorder_;
};

}  // namespace exemplar::recorder
