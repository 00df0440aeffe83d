#include "exemplar/replay/player.hpp"

#include <gmock/gmock.h>

#include <thread>

#include "exemplar/recording/writer.hpp"
#include "support/eventually.hpp"
#include "support/patient_clock.hpp"

namespace exemplar::replay {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t kBegin = 1'600'000'000'000'000'000;
constexpr const char* kIdl =
    "module lab { struct Reading { @key string source; unsigned long long seq; }; };";

struct Written {
  std::string topic;
  recording::Bytes cdr;
  Stamp source_stamp;
  Duration at{0};
};

/// Notes what is written, when; `on_write` may do something then.
class NotingOutlet final : public ircp::RawOutlet {
 public:
  explicit NotingOutlet(const Clock& clock) : clock_(clock) {}
  Result<std::unique_ptr<ircp::RawWriter>> MakeRawWriter(const ircp::RawTopic& topic) override {
    topics.push_back(topic);
    return std::unique_ptr<ircp::RawWriter>(std::make_unique<Writer>(*this, topic.topic));
  }

  std::vector<ircp::RawTopic> topics;
  std::vector<Written> written;
  std::function<Status()> on_write = [] { return Status(); };

 private:
  class Writer final : public ircp::RawWriter {
   public:
    Writer(NotingOutlet& outlet, std::string topic) : outlet_(outlet), topic_(std::move(topic)) {}
    Status Write(std::span<const std::uint8_t> cdr, Stamp source_stamp) override {
      outlet_.written.push_back(
          {topic_, {cdr.begin(), cdr.end()}, source_stamp, outlet_.clock_.Steady()});
      return outlet_.on_write();
    }
    int matched_readers() const override { return topic_ == "read" ? 1 : 0; }
    bool WaitForAcknowledgments(Duration) override { return true; }

   private:
    NotingOutlet& outlet_;
    const std::string topic_;
  };

  const Clock& clock_;
};

class PlayerTest : public ::testing::Test {
 protected:
  PlayerTest() : outlet_(clock_) {
    recording::WriterOptions options;
    options.chunk_bytes = 100;  // several chunks
    auto writer = recording::Writer::Create(sink_, options);
    writer_ = std::move(*writer);
    const std::string idl = kIdl;
    EXPECT_TRUE(writer_->AddSchema({1, "lab::Reading", "omgidl", {idl.begin(), idl.end()}}).ok());
  }

  void AddChannel(std::uint16_t id, const std::string& topic, recording::StringMap metadata = {},
                  const std::string& encoding = "cdr") {
    EXPECT_TRUE(writer_->AddChannel({id, 1, topic, encoding, std::move(metadata)}).ok());
  }
  void Add(std::uint16_t channel, Duration at) {
    const auto number = static_cast<std::uint8_t>(++messages_);
    // Plain little-endian CDR: source "a", seq.
    const recording::Bytes cdr = {0, 1, 0,      0, 2, 0, 0, 0, 'a', 0,
                                  0, 0, number, 0, 0, 0, 0, 0, 0,   0};
    const Stamp log = Stamp::FromNanoseconds(kBegin) + at;
    EXPECT_TRUE(writer_->Write({channel, messages_, log, log - milliseconds(3), cdr}).ok());
  }
  void AddSeries(int count, Duration interval) {
    AddChannel(1, "read");
    for (int i = 0; i < count; ++i) Add(1, i * interval);
  }

  Result<std::unique_ptr<Player>> Make(PlayOptions options = {}) {
    if (writer_ != nullptr) {
      EXPECT_TRUE(writer_->Close().ok());
    }
    writer_.reset();
    source_ = std::make_unique<recording::MemorySource>(sink_.bytes());
    return Player::Create(*source_, outlet_, clock_, std::move(options));
  }
  std::vector<std::int64_t> TimesMs() const {
    std::vector<std::int64_t> times;
    for (const Written& w : outlet_.written) {
      times.push_back((w.at - outlet_.written.front().at) / milliseconds(1));
    }
    return times;
  }
  std::vector<int> Numbers() const {
    std::vector<int> numbers;
    for (const Written& w : outlet_.written) numbers.push_back(w.cdr[12]);
    return numbers;
  }

  testing::PatientClock clock_;
  NotingOutlet outlet_;
  recording::MemorySink sink_;
  std::unique_ptr<recording::Writer> writer_;
  std::unique_ptr<recording::MemorySource> source_;
  std::uint32_t messages_ = 0;
};

TEST_F(PlayerTest, KeepsIntervalsBytesAndSourceTimes) {
  AddChannel(1, "read");
  AddChannel(2, "other");
  const std::vector<Duration> at = {milliseconds(0), Duration(16'666'667), milliseconds(17),
                                    milliseconds(17), milliseconds(1900)};
  for (std::size_t i = 0; i < at.size(); ++i) Add(i % 2 == 0 ? 1 : 2, at[i]);
  auto player = Make();
  ASSERT_TRUE(player.ok()) << player.error().message;
  ASSERT_TRUE((*player)->Run({}).ok());
  ASSERT_EQ(outlet_.written.size(), at.size());
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Written& written = outlet_.written[i];
    EXPECT_EQ(written.at - outlet_.written[0].at, at[i]);
    EXPECT_EQ(written.topic, i % 2 == 0 ? "read" : "other");
    EXPECT_EQ(written.source_stamp, Stamp::FromNanoseconds(kBegin) + at[i] - milliseconds(3));
    EXPECT_EQ(written.cdr[12], i + 1);
  }
  const PlayStatus status = (*player)->status();
  EXPECT_EQ(status.state, "done");
  EXPECT_EQ(status.sent, 5u);
  EXPECT_EQ(status.latest, Duration(0));
  EXPECT_EQ(status.length, milliseconds(1900));
  EXPECT_THAT((*player)->UnreadTopics(), ElementsAre("other"));
}

TEST_F(PlayerTest, PlaysFasterAndSlower) {
  AddSeries(3, milliseconds(100));
  for (const double rate : {4.0, 0.5}) {
    outlet_.written.clear();
    auto player = Make({.rate = rate});
    ASSERT_TRUE(player.ok());
    ASSERT_TRUE((*player)->Run({}).ok());
    const auto step = static_cast<std::int64_t>(100 / rate);
    EXPECT_THAT(TimesMs(), ElementsAre(0, step, 2 * step));
  }
}

TEST_F(PlayerTest, ChangesItsRateAtOnce) {
  AddSeries(5, milliseconds(100));
  auto player = Make();
  ASSERT_TRUE(player.ok());
  outlet_.on_write = [&] {
    return outlet_.written.size() == 3 ? (*player)->SetRate(10) : Status();
  };
  ASSERT_TRUE((*player)->Run({}).ok());
  EXPECT_THAT(TimesMs(), ElementsAre(0, 100, 200, 210, 220));
  EXPECT_EQ((*player)->SetRate(0).error().field, "rate");
}

TEST_F(PlayerTest, PlaysFromStartToEndAndAgain) {
  AddSeries(10, milliseconds(100));
  auto player = Make({.start = milliseconds(250), .end = milliseconds(500), .loop = true});
  ASSERT_TRUE(player.ok());
  std::stop_source stop;
  outlet_.on_write = [&] {
    if (outlet_.written.size() == 5) stop.request_stop();
    return Status();
  };
  ASSERT_TRUE((*player)->Run(stop.get_token()).ok());
  EXPECT_THAT(Numbers(), ElementsAre(4, 5, 4, 5, 4));
  EXPECT_THAT(TimesMs(), ElementsAre(0, 100, 150, 250, 300));
  EXPECT_EQ((*player)->status().passes, 3);
}

TEST_F(PlayerTest, SeeksBothWays) {
  AddSeries(10, milliseconds(100));
  auto player = Make();
  ASSERT_TRUE(player.ok());
  outlet_.on_write = [&] {
    if (outlet_.written.size() == 2) (*player)->Seek(milliseconds(700));
    if (outlet_.written.size() == 4) (*player)->Seek(milliseconds(-5));
    if (outlet_.written.size() == 6) (*player)->Seek(milliseconds(880));
    return Status();
  };
  ASSERT_TRUE((*player)->Run({}).ok());
  EXPECT_THAT(Numbers(), ElementsAre(1, 2, 8, 9, 1, 2, 10));
  EXPECT_THAT(TimesMs(), ElementsAre(0, 100, 100, 200, 200, 300, 320));
}

TEST_F(PlayerTest, StepsThroughAPauseAndGoesOnFromThere) {
  AddSeries(4, milliseconds(100));
  auto player = Make({.paused = true});
  ASSERT_TRUE(player.ok());
  std::atomic<int> sent = 0;
  outlet_.on_write = [&] {
    ++sent;
    return Status();
  };
  std::jthread running([&] { EXPECT_TRUE((*player)->Run({}).ok()); });
  EXPECT_EQ((*player)->status().state, "paused");
  for (int step = 1; step <= 2; ++step) {
    (*player)->Step();
    ASSERT_TRUE(testing::Eventually([&] { return sent == step; }));
    EXPECT_EQ((*player)->status().position, (step - 1) * milliseconds(100));
    clock_.Advance(std::chrono::hours(1));  // stands still all the same
    EXPECT_EQ((*player)->status().position, (step - 1) * milliseconds(100));
  }
  const Duration resumed = clock_.Steady();
  (*player)->Resume();
  running.join();
  ASSERT_EQ(outlet_.written.size(), 4u);
  EXPECT_EQ(outlet_.written[2].at - resumed, milliseconds(100));
  EXPECT_EQ(outlet_.written[3].at - resumed, milliseconds(200));
}

TEST_F(PlayerTest, StopsWhileItIsPaused) {
  AddSeries(2, milliseconds(100));
  auto player = Make({.paused = true});
  ASSERT_TRUE(player.ok());
  std::stop_source stop;
  std::jthread running([&] { EXPECT_TRUE((*player)->Run(stop.get_token()).ok()); });
  stop.request_stop();
  running.join();
  EXPECT_THAT(outlet_.written, IsEmpty());
}

TEST_F(PlayerTest, TellsHowLateItIsAndCatchesUp) {
  AddSeries(4, milliseconds(10));
  auto player = Make();
  ASSERT_TRUE(player.ok());
  outlet_.on_write = [&] {
    if (outlet_.written.size() == 1) clock_.Advance(milliseconds(25));  // a slow network
    return outlet_.written.size() == 4 ? Status(Unavailable("gone")) : Status();
  };
  ASSERT_TRUE((*player)->Run({}).ok());
  EXPECT_THAT(TimesMs(), ElementsAre(0, 25, 25, 30));
  const PlayStatus status = (*player)->status();
  EXPECT_EQ(status.latest, milliseconds(15));
  EXPECT_EQ(status.mean_lateness, milliseconds(5));
  EXPECT_EQ(status.sent, 3u);
  EXPECT_EQ(status.refused, 1u);
}

TEST_F(PlayerTest, OffersWhatTheRecordedWriterOffered) {
  AddChannel(1, "a",
             {{"type", "lab::Reading"},
              {"keyed", "false"},
              {"reliability", "best_effort"},
              {"durability", "transient_local"},
              {"deadline_s", "0.5"}});
  AddChannel(2, "b");  // of an older recorder
  Add(1, milliseconds(0));
  Add(2, milliseconds(1));
  ASSERT_TRUE(Make().ok());
  ASSERT_EQ(outlet_.topics.size(), 2u);
  const ircp::RawTopic& a = outlet_.topics[0];
  EXPECT_EQ(a.type, "lab::Reading");
  EXPECT_EQ(a.schema, kIdl);
  EXPECT_FALSE(a.keyed);
  EXPECT_FALSE(a.reliable);
  EXPECT_TRUE(a.transient_local);
  EXPECT_EQ(a.deadline, milliseconds(500));
  const ircp::RawTopic& b = outlet_.topics[1];
  EXPECT_EQ(b.type, "lab::Reading");
  EXPECT_TRUE(b.keyed);
  EXPECT_TRUE(b.reliable);
  EXPECT_FALSE(b.transient_local);
  EXPECT_EQ(b.deadline, Duration(0));
}

TEST_F(PlayerTest, LeavesOutWhatWouldActAndWhatItCannotSend) {
  std::uint16_t id = 0;
  for (const char* topic : {"ircp/recorder/command", "ircp/executor/status", "ircp/joint_command",
                            "ircp/safety", "ircp/clock", "ircp/suit", "command"}) {
    AddChannel(++id, topic);
    Add(id, milliseconds(id));
  }
  AddChannel(++id, "ros", {}, "ros1");
  auto player = Make();
  ASSERT_TRUE(player.ok());
  ASSERT_TRUE((*player)->Run({}).ok());
  EXPECT_THAT(Numbers(), ElementsAre(6, 7));
  const std::vector<TopicPlan>& plans = (*player)->topics();
  EXPECT_EQ(plans[0].left_out, "not chosen");
  EXPECT_EQ(plans[5].left_out, "");
  EXPECT_EQ(plans[5].messages, 1u);
  EXPECT_THAT(plans[7].left_out, HasSubstr("\"ros1\", not cdr"));
}

TEST_F(PlayerTest, AnnouncesTheLastNumbersThatItSent) {
  AddSeries(3, milliseconds(1));
  auto player = Make();
  ASSERT_TRUE(player.ok());
  ASSERT_TRUE((*player)->Run({}).ok());
  const std::vector<ircp::TopicCount> sent = (*player)->sent();
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0].topic, "read");
  EXPECT_EQ(sent[0].source, "a");
  EXPECT_EQ(sent[0].sent, 3u);
}

TEST_F(PlayerTest, NamesWhatItCannotPlay) {
  AddSeries(3, milliseconds(100));
  EXPECT_THAT(Make({.rate = 0}).error().message, HasSubstr("rate is 0"));
  EXPECT_THAT(Make({.start = milliseconds(300)}).error().message,
              HasSubstr("start is 0.300 s, must lie between 0 and the recording's 0.200 s"));
  EXPECT_EQ(Make({.start = milliseconds(20), .end = milliseconds(20)}).error().field, "end");
  const auto nothing = Make({.wanted = [](const std::string&) { return false; }});
  EXPECT_THAT(nothing.error().message,
              HasSubstr("nothing to play: left out are read (not chosen)"));
  const recording::Bytes cut(sink_.bytes().begin(), sink_.bytes().end() - 20);
  recording::MemorySource source(cut);
  EXPECT_EQ(Player::Create(source, outlet_, clock_, {}).error().code, ErrorCode::kDataLoss);
}

}  // namespace
}  // namespace exemplar::replay
