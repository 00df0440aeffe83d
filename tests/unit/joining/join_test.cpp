#include "exemplar/joining/join.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "exemplar/base/rng.hpp"
#include "exemplar/ircp/clock_relation.hpp"

namespace exemplar::joining {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr std::int64_t kStart = 1'700'000'000'000'000'000;

Stamp At(double seconds) { return Stamp::FromNanoseconds(kStart) + FromSeconds(seconds); }

/// A clock: what it shows at a true time.
struct TrueClock {
  double ahead_s = 0;
  double drift = 0;
  Stamp Show(double true_s) const { return At(true_s + ahead_s + drift * true_s); }
  /// As an observer measures it at a true time.
  ircp::ClockRelation SeenBy(const TrueClock& observer, const std::string& participant,
                             const std::string& program, double true_s,
                             const std::string& observer_name) const {
    return {.participant = participant,
            .program = program,
            .observer = observer_name,
            .at = observer.Show(true_s),
            .offset = Show(true_s) - observer.Show(true_s),
            .drift = (drift - observer.drift) / (1 + observer.drift),
            .uncertainty = std::chrono::microseconds(100),
            .exchanges = 60,
            .since = observer.Show(0)};
  }
};

/// A recording as the recorder writes it.
class File {
 public:
  explicit File(std::string station = "lab") {
    writer_ = std::move(*recording::Writer::Create(sink_, {.chunk_bytes = 512}));
    Put("exemplar.recording", {{"name", "t"}, {"station", std::move(station)}});
  }

  void Add(const std::string& topic, const std::string& writer, std::uint32_t number, Stamp log,
           Stamp publish) {
    const auto [known, added] = channels_.try_emplace({topic, writer}, next_);
    if (added) {
      const recording::Channel channel{next_++, 0, topic, "cdr", {{"writer", writer}}};
      ASSERT_TRUE(writer_->AddChannel(channel).ok());
    }
    const recording::Message message{
        known->second, number, log, publish, {0, 1, 0, 0, static_cast<std::uint8_t>(number)}};
    ASSERT_TRUE(writer_->Write(message).ok());
  }

  void Put(const std::string& name, recording::StringMap fields) {
    ASSERT_TRUE(writer_->Write(recording::Metadata{name, std::move(fields)}).ok());
  }
  void See(const ircp::ClockRelation& relation) { Put("exemplar.clock", ToFields(relation)); }

  const recording::Bytes& Close() {
    EXPECT_TRUE(writer_->Close().ok());
    return sink_.bytes();
  }

 private:
  recording::MemorySink sink_;
  std::unique_ptr<recording::Writer> writer_;
  std::map<std::pair<std::string, std::string>, std::uint16_t> channels_;
  std::uint16_t next_ = 1;
};

/// What stands in a joined file.
struct Content {
  std::vector<std::pair<std::string, recording::Message>> messages;  ///< with their writers
  std::map<std::string, recording::StringMap> last;                  ///< metadata by name
  std::vector<recording::Metadata> metadata;
};

Content Read(const recording::Bytes& bytes) {
  Content content;
  recording::MemorySource source(bytes);
  const auto reader = recording::IndexedReader::Open(source);
  EXPECT_TRUE(reader.ok());
  EXPECT_TRUE(
      (*reader)
          ->ReadMessages({},
                         [&](const recording::Message& message) {
                           const auto& channel = (*reader)->channels().at(message.channel_id);
                           content.messages.emplace_back(channel.metadata.at("writer"), message);
                           return true;
                         })
          .ok());
  for (const auto& index : (*reader)->metadata()) {
    content.metadata.push_back(*(*reader)->ReadMetadata(index));
    content.last[index.name] = content.metadata.back().metadata;
  }
  return content;
}

struct Joined {
  Result<JoinReport> report;
  recording::Bytes bytes;
};

Joined JoinBytes(const std::vector<const recording::Bytes*>& files, JoinOptions options = {}) {
  std::vector<recording::MemorySource> sources;
  std::vector<Input> inputs;
  sources.reserve(files.size());
  for (const recording::Bytes* bytes : files) {
    sources.emplace_back(*bytes);
    inputs.push_back(
        {std::string(1, static_cast<char>('a' + inputs.size())) + ".mcap", &sources.back()});
  }
  recording::MemorySink out;
  Result<JoinReport> report = Join(inputs, out, options);
  return {std::move(report), out.bytes()};
}

TEST(JoinTest, BringsEveryMessageOntoTheFirstFilesClock) {
  Rng rng(7);
  for (int round = 0; round < 20; ++round) {
    const TrueClock first{.ahead_s = 20 * (rng.Uniform() - 0.5), .drift = 1e-4 * rng.Uniform()};
    const TrueClock second{.ahead_s = 20 * (rng.Uniform() - 0.5), .drift = -1e-4 * rng.Uniform()};
    const TrueClock common{.ahead_s = rng.Uniform()};
    File a;
    File b;
    // One recorder saw the other, or was seen by it, or both saw a program.
    for (const double t : {5.0, 30.0, 60.0}) {
      if (round % 3 == 0) a.See(second.SeenBy(first, "pb", "recorder", t, "pa"));
      if (round % 3 == 0) b.See(second.SeenBy(second, "pb", "recorder", t, "pb"));
      if (round % 3 == 1) b.See(first.SeenBy(second, "pa", "recorder", t, "pb"));
      if (round % 3 == 1) a.See(first.SeenBy(first, "pa", "recorder", t, "pa"));
      if (round % 3 == 2) a.See(common.SeenBy(first, "px", "simulator", t, "pa"));
      if (round % 3 == 2) b.See(common.SeenBy(second, "px", "simulator", t, "pb"));
    }
    std::map<std::pair<std::string, std::uint32_t>, double> truth;
    for (std::uint32_t i = 1; i <= 200; ++i) {
      const double t = 0.3 * i;
      a.Add("x", "wa", i, first.Show(t), common.Show(t));
      b.Add("y", "wb", i, second.Show(t + 0.1), common.Show(t));
      truth[{"wa", i}] = t;
      truth[{"wb", i}] = t + 0.1;
    }
    const Joined joined = JoinBytes({&a.Close(), &b.Close()});
    ASSERT_TRUE(joined.report.ok()) << joined.report.error().message;
    const JoinReport& report = *joined.report;
    EXPECT_EQ(report.messages, 400U);
    const double offset = ToSeconds(second.Show(0.4) - first.Show(0.4));
    EXPECT_NEAR(ToSeconds(report.files[1].offset), offset, 1e-6);
    EXPECT_NEAR(report.files[1].drift, second.drift - first.drift, 1e-7);
    const Content content = Read(joined.bytes);
    Stamp before;
    for (const auto& [writer, message] : content.messages) {
      const double true_s = truth.at({writer, message.sequence});
      EXPECT_NEAR(ToSeconds(message.log_time - first.Show(true_s)), 0, 1e-6);
      const double sent_s = writer == "wa" ? true_s : true_s - 0.1;
      EXPECT_NEAR(ToSeconds(message.publish_time - common.Show(sent_s)), 0, 1e-6);
      EXPECT_LE(before, message.log_time);
      before = message.log_time;
    }
    // The second recorder's clock, as the joined file tells it.
    ircp::ClockTrack track;
    for (const recording::Metadata& metadata : content.metadata) {
      if (metadata.name != "exemplar.clock") continue;
      const auto relation = ircp::ClockRelationFromFields(metadata.metadata);
      ASSERT_TRUE(relation.ok());
      if (relation->participant == "pb") track.Add(*relation);
    }
    ASSERT_FALSE(track.empty());
    EXPECT_NEAR(ToSeconds(track.OffsetAt(first.Show(33))),
                ToSeconds(second.Show(33) - first.Show(33)), 1e-6);
  }
}

TEST(JoinTest, CountsASampleOnceAndLosesOnlyWhatNobodyHas) {
  Rng rng(11);
  for (int round = 0; round < 20; ++round) {
    File a;
    File b;
    std::set<std::uint32_t> in_a;
    std::set<std::uint32_t> in_b;
    for (std::uint32_t i = 1; i <= 500; ++i) {
      if (i > 20 && i < 400 && rng.Uniform() < 0.8) {
        a.Add("x", "w", i, At(0.01 * i), At(0.01 * i));
        in_a.insert(i);
      }
      if (i > 100 && rng.Uniform() < 0.8) {
        b.Add("x", "w", i, At(0.01 * i + 0.003), At(0.01 * i));
        in_b.insert(i);
      }
    }
    const auto told = [](File& file, const std::set<std::uint32_t>& numbers) {
      const std::uint32_t range = *numbers.rbegin() - *numbers.begin() + 1;
      file.Put("exemplar.losses", {{"topic", "x"},
                                   {"writer", "w"},
                                   {"source", "suit"},
                                   {"received", std::to_string(numbers.size())},
                                   {"lost_in_gaps", std::to_string(range - numbers.size())},
                                   {"lost_at_end", "0"},
                                   {"announced", "503"}});
    };
    told(a, in_a);
    told(b, in_b);
    std::set<std::uint32_t> both = in_a;
    both.insert(in_b.begin(), in_b.end());
    const Joined joined = JoinBytes({&a.Close(), &b.Close()}, {.same_clock = true});
    ASSERT_TRUE(joined.report.ok()) << joined.report.error().message;
    EXPECT_EQ(joined.report->messages, both.size());
    const std::size_t range = *both.rbegin() - *both.begin() + 1;
    EXPECT_EQ(joined.report->lost, range - both.size() + 503 - *both.rbegin());
    EXPECT_EQ(joined.report->files[0].repeated + joined.report->files[1].repeated,
              in_a.size() + in_b.size() - both.size());
    Content content = Read(joined.bytes);
    ASSERT_EQ(content.messages.size(), both.size());
    for (const auto& [writer, message] : content.messages) {
      EXPECT_EQ(both.erase(message.sequence), 1U);
    }
    EXPECT_EQ(content.last["exemplar.losses"]["source"], "suit");
    EXPECT_EQ(content.last["exemplar.losses"]["lost_at_end"],
              std::to_string(503 - content.messages.back().second.sequence));
  }
}

TEST(JoinTest, MergesWhatPeopleWroteAndSaysWhereTheyDisagree) {
  File a;
  File b;
  a.Put("exemplar.trial", {{"operator", "anna"}, {"skill", "press"}});
  b.Put("exemplar.trial", {{"operator", "ben"}, {"room", "2"}});
  b.Put("exemplar.labels", {{"success", "yes"}});
  b.Put("exemplar.event", {{"note", "stuck"}});
  a.Add("x", "wa", 1, At(1), At(1));
  b.Add("x", "wb", 1, At(2), At(2));
  const Joined joined = JoinBytes({&a.Close(), &b.Close()}, {.same_clock = true});
  ASSERT_TRUE(joined.report.ok());
  Content content = Read(joined.bytes);
  EXPECT_EQ(
      content.last["exemplar.trial"],
      (recording::StringMap{
          {"operator", "anna"}, {"operator (b.mcap)", "ben"}, {"room", "2"}, {"skill", "press"}}));
  EXPECT_EQ(content.last["exemplar.labels"]["success"], "yes");
  EXPECT_EQ(content.last["exemplar.event"]["note"], "stuck");
  EXPECT_EQ(content.last["exemplar.event"]["file"], "b.mcap");
  EXPECT_EQ(content.last["exemplar.recording"]["joined_from"], "a.mcap, b.mcap");
  EXPECT_THAT(joined.report->notices, Contains(HasSubstr("ben")));
}

TEST(JoinTest, RelatesFilesOverAThird) {
  const TrueClock first;
  const TrueClock second{.ahead_s = 3};
  const TrueClock third{.ahead_s = -4};
  File a;
  File b;
  File c;
  a.See(third.SeenBy(first, "pc", "recorder", 1, "pa"));
  b.See(third.SeenBy(second, "pc2", "recorder", 1, "pb"));
  c.See(second.SeenBy(third, "pb", "recorder", 1, "pc"));
  a.Add("x", "wa", 1, first.Show(1), At(1));
  b.Add("x", "wb", 1, second.Show(1), At(1));
  c.Add("x", "wc", 1, third.Show(1), At(1));
  const Joined joined = JoinBytes({&a.Close(), &b.Close(), &c.Close()});
  ASSERT_TRUE(joined.report.ok()) << joined.report.error().message;
  for (const auto& [writer, message] : Read(joined.bytes).messages) {
    EXPECT_EQ(message.log_time, first.Show(1)) << writer;
  }
}

TEST(JoinTest, LeavesClocksAloneThatCannotBeToldApart) {
  const TrueClock first;
  const TrueClock second{.ahead_s = 5e-5};
  File a;
  File b;
  a.See(second.SeenBy(first, "pb", "recorder", 1, "pa"));
  b.See(second.SeenBy(second, "pb", "recorder", 1, "pb"));
  a.Add("x", "wa", 1, At(1), At(1));
  b.Add("x", "wb", 1, At(2), At(2));
  const Joined joined = JoinBytes({&a.Close(), &b.Close()});
  ASSERT_TRUE(joined.report.ok());
  EXPECT_EQ(joined.report->files[1].offset, Duration(0));
  EXPECT_EQ(Read(joined.bytes).messages.back().second.log_time, At(2));
}

TEST(JoinTest, NamesTheFileThatCannotBeJoined) {
  File a;
  File b;
  File other("hall");
  a.Add("x", "wa", 1, At(1), At(1));
  b.Add("x", "wb", 1, At(2), At(2));
  other.Add("x", "wc", 1, At(2), At(2));
  const recording::Bytes& bytes_a = a.Close();
  const recording::Bytes& bytes_b = b.Close();
  const auto message = [](const Joined& joined) {
    return joined.report.ok() ? std::string() : joined.report.error().message;
  };
  EXPECT_THAT(message(JoinBytes({&bytes_a, &bytes_b})), HasSubstr("b.mcap: nothing relates"));
  EXPECT_THAT(message(JoinBytes({&bytes_a, &other.Close()}, {.same_clock = true})),
              HasSubstr("b.mcap: was recorded in station \"hall\""));
  const recording::Bytes none;
  EXPECT_THAT(message(JoinBytes({&bytes_a, &none})), HasSubstr("b.mcap: "));
  recording::Bytes cut = bytes_b;
  for (std::size_t size = 0; size < bytes_b.size(); size += 7) {
    cut.resize(size);
    const Joined joined = JoinBytes({&bytes_a, &cut}, {.same_clock = true});
    EXPECT_THAT(message(joined), HasSubstr("b.mcap: "));
    cut = bytes_b;
  }
  File odd;
  odd.Put("exemplar.clock", {{"participant", "p"}});
  EXPECT_THAT(message(JoinBytes({&bytes_a, &odd.Close()})),
              HasSubstr("b.mcap: metadata exemplar.clock: "));
}

}  // namespace
}  // namespace exemplar::joining
