// Real DDS between participants of one process, on whatever interfaces there are.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <mutex>
#include <set>
#include <vector>

#include "exemplar/bus/codec.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/ircp/clock_watch.hpp"
#include "support/dds_domain.hpp"
#include "support/eventually.hpp"

namespace exemplar::bus {
namespace {

using ircp::Reception;
using testing::DdsDomain;
using testing::Eventually;

/// Collects what arrives on the network's threads.
template <class Sample>
class Inbox {
 public:
  ircp::Callback<Sample> callback() {
    return [this](const Sample& sample, const Reception&) {
      const std::lock_guard lock(mutex_);
      samples_.push_back(sample);
    };
  }
  std::vector<Sample> samples() const {
    const std::lock_guard lock(mutex_);
    return samples_;
  }
  std::size_t size() const { return samples().size(); }

 private:
  mutable std::mutex mutex_;
  std::vector<Sample> samples_;
};

class BusTest : public ::testing::Test {
 protected:
  std::unique_ptr<Participant> Join(const std::string& station, ParticipantOptions options = {}) {
    options.domain = domain_.number();
    options.station = station;
    Result<std::unique_ptr<Participant>> participant = Participant::Create(options);
    EXPECT_TRUE(participant.ok()) << (participant.ok() ? "" : participant.error().message);
    return participant.ok() ? std::move(*participant) : nullptr;
  }

  DdsDomain domain_;
};

template <class Sample>
std::unique_ptr<ircp::Writer<Sample>> WriterOf(Participant& participant,
                                               const std::string& source) {
  auto writer = participant.MakeWriter<Sample>(source);
  EXPECT_TRUE(writer.ok());
  return std::move(*writer);
}

template <class Sample>
std::unique_ptr<ircp::Reader> ReaderOf(Participant& participant, ircp::Callback<Sample> callback) {
  auto reader = participant.MakeReader<Sample>(std::move(callback));
  EXPECT_TRUE(reader.ok());
  return std::move(*reader);
}

ircp::SuitSample Suit(double angle) {
  ircp::SuitSample sample;
  sample.names = {"shoulder", "elbow"};
  sample.positions = {angle, -angle};
  return sample;
}

TEST_F(BusTest, ReliableBurstArrivesWholeAndInOrder) {
  constexpr int kSamples = 1500;
  const auto a = Join("lab");
  const auto b = Join("lab");
  Inbox<ircp::SuitSample> inbox;
  const auto reader = ReaderOf<ircp::SuitSample>(*b, inbox.callback());
  const auto writer = WriterOf<ircp::SuitSample>(*a, "suit-1");
  ASSERT_TRUE(Eventually([&] { return writer->matched_readers() == 1; }));
  ASSERT_TRUE(Eventually([&] { return reader->matched_writers() == 1; }));
  for (int i = 0; i < kSamples; ++i) ASSERT_TRUE(writer->Write(Suit(0.001 * i)).ok());
  ASSERT_TRUE(Eventually([&] { return inbox.size() >= kSamples; })) << inbox.size();

  const std::vector<ircp::SuitSample> samples = inbox.samples();
  ASSERT_EQ(samples.size(), kSamples);
  for (int i = 0; i < kSamples; ++i) {
    EXPECT_EQ(samples[i].header.source, "suit-1");
    EXPECT_EQ(samples[i].header.seq, i + 1u);
    EXPECT_EQ(samples[i].positions[0], 0.001 * i);
  }
  EXPECT_EQ(writer->sent(), kSamples);
  const std::vector<ircp::SourceCount> counts = reader->counts();
  ASSERT_EQ(counts.size(), 1u);
  EXPECT_EQ(counts[0].received, kSamples);
  EXPECT_EQ(counts[0].lost, 0u);
}

TEST_F(BusTest, RawTapSeesSchemaAndBytesThatDecode) {
  const auto a = Join("lab");
  const auto b = Join("lab");
  const auto writer = WriterOf<ircp::SuitSample>(*a, "suit-1");
  std::mutex mutex;
  std::vector<ircp::RawSample> raw;
  ircp::RawTapOptions options;
  options.on_sample = [&](ircp::RawSample&& sample) {
    const std::lock_guard lock(mutex);
    raw.push_back(std::move(sample));
  };
  auto tap = b->MakeTap(options);
  ASSERT_TRUE(tap.ok());
  ASSERT_TRUE(Eventually([&] { return (*tap)->matched_writers("ircp/suit") == 1; }));
  ASSERT_TRUE(Eventually([&] { return writer->matched_readers() == 1; }));
  ircp::SuitSample sent = Suit(0.5);
  sent.header.stamp = Stamp::FromNanoseconds(1234567890);
  ASSERT_TRUE(writer->Write(sent).ok());
  ASSERT_TRUE(Eventually([&] {
    const std::lock_guard lock(mutex);
    return !raw.empty();
  }));

  const std::vector<ircp::RawTopic> topics = (*tap)->topics();
  ASSERT_EQ(topics.size(), 1u);
  EXPECT_EQ(topics[0].topic, "ircp/suit");
  EXPECT_EQ(topics[0].type, TypeNameOf<ircp::SuitSample>());
  EXPECT_EQ(topics[0].schema, SchemaOf<ircp::SuitSample>());
  EXPECT_EQ(topics[0].partition, "lab");
  EXPECT_TRUE(topics[0].keyed);
  EXPECT_TRUE(topics[0].reliable);
  const std::lock_guard lock(mutex);
  ASSERT_EQ(raw.size(), 1u);
  EXPECT_TRUE(raw[0].valid);
  EXPECT_EQ(raw[0].sequence, 1u);
  const Result<ircp::SuitSample> decoded = Decode<ircp::SuitSample>(raw[0].cdr);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  EXPECT_EQ(decoded->header.source, "suit-1");
  EXPECT_EQ(decoded->header.stamp, Stamp::FromNanoseconds(1234567890));
  EXPECT_EQ(decoded->positions, sent.positions);
}

TEST_F(BusTest, TapsThatLookOnAreNobodysReaders) {
  const auto a = Join("lab");
  const auto b = Join("lab");
  const auto writer = WriterOf<ircp::SuitSample>(*a, "suit-1");
  const auto raw_writer = a->MakeRawWriter({.topic = "lab/notes",
                                            .type = "lab::Note",
                                            .schema = "struct Note { long n; };",
                                            .partition = {},
                                            .reliable = true});
  ASSERT_TRUE(raw_writer.ok());
  std::atomic<int> tapped = 0;
  ircp::RawTapOptions options;
  options.on_sample = [&](ircp::RawSample&&) { ++tapped; };
  options.observer = true;
  const auto onlooker = b->MakeTap(options);
  ASSERT_TRUE(onlooker.ok());
  ASSERT_TRUE(Eventually([&] {
    EXPECT_TRUE(writer->Write(Suit(0.5)).ok());
    EXPECT_TRUE((*raw_writer)->Write(std::vector<std::uint8_t>{0, 1, 0, 0, 1, 0, 0, 0}, {}).ok());
    return (*onlooker)->matched_writers("ircp/suit") == 1 &&
           (*onlooker)->matched_writers("lab/notes") == 1 && tapped >= 2;
  }));
  EXPECT_EQ(writer->matched_readers(), 0);
  EXPECT_EQ((*raw_writer)->matched_readers(), 0);

  auto tap = b->MakeTap({});
  ASSERT_TRUE(tap.ok());
  EXPECT_TRUE(Eventually(
      [&] { return writer->matched_readers() == 1 && (*raw_writer)->matched_readers() == 1; }));
  tap = Error{};
  EXPECT_TRUE(Eventually([&] { return writer->matched_readers() == 0; }));
}

TEST_F(BusTest, StationsNeverMix) {
  const auto a = Join("lab-a");
  const auto b = Join("lab-b");
  Inbox<ircp::SafetySample> inbox_a;
  Inbox<ircp::SafetySample> inbox_b;
  const auto reader_a = ReaderOf<ircp::SafetySample>(*a, inbox_a.callback());
  const auto reader_b = ReaderOf<ircp::SafetySample>(*b, inbox_b.callback());
  std::atomic<int> tapped = 0;
  ircp::RawTapOptions options;
  options.on_sample = [&](ircp::RawSample&&) { ++tapped; };
  auto tap = b->MakeTap(options);
  ASSERT_TRUE(tap.ok());
  const auto writer_a = WriterOf<ircp::SafetySample>(*a, "button-a");
  const auto writer_b = WriterOf<ircp::SafetySample>(*b, "button-b");
  ASSERT_TRUE(Eventually([&] { return writer_a->matched_readers() == 1; }));
  // The other station's writer comes last: once its sample is here, a leak of the first would be.
  ASSERT_TRUE(Eventually([&] { return writer_b->matched_readers() == 2; }));
  ASSERT_TRUE(Eventually([&] { return (*tap)->matched_writers("ircp/safety") == 1; }));
  ASSERT_TRUE(Eventually(
      [&] { return reader_a->matched_writers() == 1 && reader_b->matched_writers() == 1; }));
  ASSERT_TRUE(writer_a->Write({}).ok());
  ASSERT_TRUE(Eventually([&] { return inbox_a.size() == 1; }));
  ASSERT_TRUE(writer_b->Write({}).ok());
  ASSERT_TRUE(Eventually([&] { return inbox_b.size() == 1 && tapped == 1; }));

  EXPECT_EQ(inbox_a.samples()[0].header.source, "button-a");
  EXPECT_EQ(inbox_b.samples()[0].header.source, "button-b");
  EXPECT_EQ(writer_a->matched_readers(), 1);
  EXPECT_EQ(tapped, 1);
}

TEST_F(BusTest, BigPicturesArrive) {
  const auto a = Join("lab");
  const auto b = Join("lab");
  Inbox<ircp::CameraSample> inbox;
  const auto reader = ReaderOf<ircp::CameraSample>(*b, inbox.callback());
  const auto writer = WriterOf<ircp::CameraSample>(*a, "stereo");
  ASSERT_TRUE(
      Eventually([&] { return writer->matched_readers() == 1 && reader->matched_writers() == 1; }));
  ircp::CameraSample sent;
  sent.encoding = "png";
  sent.left.assign(300'000, 17);
  sent.right.assign(280'000, 18);
  // Best effort: repeated until one comes.
  ASSERT_TRUE(Eventually([&] {
    EXPECT_TRUE(writer->Write(sent).ok());
    return inbox.size() > 0;
  }));
  EXPECT_EQ(inbox.samples()[0].left, sent.left);
  EXPECT_EQ(inbox.samples()[0].right, sent.right);
}

/// Ports of Fast DDS's shared memory that this process has open, its own and its neighbours'.
int SharedMemoryPorts() {
  std::ifstream maps("/proc/self/maps");
  int ports = 0;
  for (std::string line; std::getline(maps, line);) {
    if (line.find("fastrtps_port") != std::string::npos) ++ports;
  }
  return ports;
}

// Fast DDS 2.9 sleeps .33 s, holding up all that a participant sends, when it opens a port of
// shared memory whose owner happens to be idle: a robot would be taken for silent whenever a
// program joins.
TEST_F(BusTest, OpensNobodysSharedMemoryUnlessPicturesAskForIt) {
  const auto exchange = [this](const ParticipantOptions& options) {
    const auto a = Join("lab", options);
    const auto b = Join("lab", options);
    Inbox<ircp::SuitSample> inbox;
    const auto reader = ReaderOf<ircp::SuitSample>(*b, inbox.callback());
    const auto writer = WriterOf<ircp::SuitSample>(*a, "suit-1");
    EXPECT_TRUE(Eventually(
        [&] { return writer->matched_readers() == 1 && reader->matched_writers() == 1; }));
    EXPECT_TRUE(writer->Write(Suit(0.1)).ok());
    EXPECT_TRUE(Eventually([&] { return inbox.size() == 1; }));
    return SharedMemoryPorts();
  };
  EXPECT_EQ(exchange({}), 0);
  EXPECT_GT(exchange({.shared_memory_bytes = kPictureSharedMemoryBytes}), 0);
}

TEST_F(BusTest, CountsExactlyWhatBestEffortLoses) {
  // Without shared memory, pictures in one burst overrun the socket: some are lost, or none.
  const auto a = Join("lab", {.shared_memory_bytes = 0});
  const auto b = Join("lab", {.shared_memory_bytes = 0});
  std::mutex mutex;
  std::set<std::uint64_t> numbers;
  const auto reader =
      ReaderOf<ircp::CameraSample>(*b, [&](const ircp::CameraSample& sample, const Reception&) {
        const std::lock_guard lock(mutex);
        numbers.insert(sample.header.seq);
      });
  const auto writer = WriterOf<ircp::CameraSample>(*a, "stereo");
  ASSERT_TRUE(
      Eventually([&] { return writer->matched_readers() == 1 && reader->matched_writers() == 1; }));
  ircp::CameraSample sent;
  sent.left.assign(600'000, 1);
  for (int i = 0; i < 60; ++i) ASSERT_TRUE(writer->Write(sent).ok());
  // Small ones until one has come and none is under way: the last may be lost like any other.
  sent.left.clear();
  ASSERT_TRUE(Eventually([&] {
    {
      const std::lock_guard lock(mutex);
      if (writer->sent() > 60 && !numbers.empty() && *numbers.rbegin() == writer->sent()) {
        return true;
      }
    }
    EXPECT_TRUE(writer->Write(sent).ok());
    return false;
  }));
  const std::uint64_t last = writer->sent();
  const std::lock_guard lock(mutex);
  const std::vector<ircp::SourceCount> counts = reader->counts();
  ASSERT_EQ(counts.size(), 1u);
  EXPECT_EQ(counts[0].received, numbers.size());
  EXPECT_EQ(counts[0].lost, last - *numbers.begin() + 1 - numbers.size());
}

TEST_F(BusTest, LateReaderGetsTheLastStatusAndNoOldCommand) {
  const auto a = Join("lab");
  const auto b = Join("lab");
  auto status = a->MakeWriterOn<ircp::StatusSample>("ircp/recorder/status", "recorder");
  auto command = a->MakeWriterOn<ircp::CommandSample>("ircp/recorder/command", "cli");
  ASSERT_TRUE(status.ok() && command.ok());
  ircp::StatusSample ready;
  ready.program = "recorder";
  ready.state = "ready";
  ASSERT_TRUE((*status)->Write(ready).ok());
  ircp::CommandSample old;
  old.program = "recorder";
  old.request_id = "r1";
  old.action = "start";
  ASSERT_TRUE((*command)->Write(old).ok());

  Inbox<ircp::StatusSample> statuses;
  Inbox<ircp::CommandSample> commands;
  auto status_reader =
      b->MakeReaderOn<ircp::StatusSample>("ircp/recorder/status", statuses.callback());
  auto command_reader =
      b->MakeReaderOn<ircp::CommandSample>("ircp/recorder/command", commands.callback());
  ASSERT_TRUE(status_reader.ok() && command_reader.ok());
  ASSERT_TRUE(Eventually([&] { return statuses.size() == 1; }));
  EXPECT_EQ(statuses.samples()[0].state, "ready");
  ASSERT_TRUE(Eventually([&] {
    return (*command)->matched_readers() == 1 && (*command_reader)->matched_writers() == 1;
  }));
  ircp::CommandSample fresh = old;
  fresh.request_id = "r2";
  ASSERT_TRUE((*command)->Write(fresh).ok());
  ASSERT_TRUE(Eventually([&] { return commands.size() > 0; }));
  EXPECT_EQ(commands.samples()[0].request_id, "r2");
}

TEST_F(BusTest, RefusesWhatItCannotSend) {
  const auto a = Join("lab");
  EXPECT_FALSE(a->MakeWriter<ircp::SuitSample>("").ok());
  EXPECT_FALSE(a->MakeWriter<ircp::SuitSample>(std::string(256, 'x')).ok());
  const auto writer = WriterOf<ircp::SuitSample>(*a, "suit-1");
  ircp::SuitSample bad = Suit(0.1);
  bad.positions.pop_back();
  const Status written = writer->Write(bad);
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(written.error().field, "positions");
  EXPECT_EQ(writer->sent(), 0u);
  // One topic, one type.
  EXPECT_FALSE(
      a->MakeReaderOn<ircp::SafetySample>(ircp::SuitSample::kTopic, [](const ircp::SafetySample&,
                                                                       const Reception&) {
       }).ok());
}

TEST(ParticipantTest, RefusesOptionsThatNameNothing) {
  const auto error_field = [](ParticipantOptions options) {
    auto participant = Participant::Create(std::move(options));
    return participant.ok() ? std::string("accepted") : participant.error().field;
  };
  EXPECT_EQ(error_field({.domain = 233}), "domain");
  EXPECT_EQ(error_field({.station = ""}), "station");
  EXPECT_EQ(error_field({.station = "lab*"}), "station");
  EXPECT_EQ(error_field({.interfaces = {"no-such-interface"}}), "interfaces");
  EXPECT_EQ(error_field({.peers = {"not an address"}}), "peers");
}

TEST_F(BusTest, TopicsThatAreConfiguredSoGoBestEffortAndTapsReadThemToo) {
  const ParticipantOptions options{.best_effort_topics = {"ircp/joint_state"}};
  const auto robot = Join("lab", options);
  const auto executor = Join("lab", options);
  const auto recorder = Join("lab");
  Inbox<ircp::JointStateSample> inbox;
  const auto reader = ReaderOf<ircp::JointStateSample>(*executor, inbox.callback());
  const auto writer = WriterOf<ircp::JointStateSample>(*robot, "robot");
  std::atomic<int> taken = 0;
  std::atomic<bool> reliable = true;
  ircp::RawTapOptions tapping;
  tapping.on_topic = [&](const ircp::RawTopic& topic) { reliable = topic.reliable; };
  tapping.on_sample = [&](ircp::RawSample&&) { ++taken; };
  const auto tap = recorder->MakeTap(tapping);
  ASSERT_TRUE(tap.ok());
  ASSERT_TRUE(Eventually([&] { return writer->matched_readers() == 2; }));
  ASSERT_TRUE(Eventually([&] { return (*tap)->matched_writers("ircp/joint_state") == 1; }));
  ircp::JointStateSample sample;
  sample.names = {"elbow"};
  sample.positions = {0.5};
  ASSERT_TRUE(Eventually([&] {
    EXPECT_TRUE(writer->Write(sample).ok());
    return inbox.size() > 0 && taken > 0;
  }));
  EXPECT_FALSE(reliable);
}

TEST_F(BusTest, RefusesADiscoveryServerThatIsNoAddress) {
  for (const char* address :
       {"nowhere", "10.0.0.1", "10.0.0.1:0", "10.0.0.1:70000", ":11811", ""}) {
    ParticipantOptions options{.domain = domain_.number(), .discovery_servers = {address}};
    const auto participant = Participant::Create(options);
    ASSERT_FALSE(participant.ok()) << address;
    EXPECT_THAT(participant.error().message, ::testing::HasSubstr(address));
  }
}

TEST_F(BusTest, ClocksAreComparedOverTheNetwork) {
  /// Runs ahead of the machine's.
  class AheadClock final : public Clock {
   public:
    Stamp Now() const override { return clock_.Now() + std::chrono::seconds(5); }
    Duration Steady() const override { return clock_.Steady(); }
    bool SleepUntil(Duration steady, std::stop_token stop) const override {
      return clock_.SleepUntil(steady, std::move(stop));
    }

   private:
    SystemClock clock_;
  };
  const AheadClock ahead;
  const SystemClock clock;
  NullLog log;
  const auto suit = Join("lab", {.clock = &ahead});
  const auto recorder = Join("lab", {.clock = &clock});
  const auto responder = ircp::ClockResponder::Create(*suit, ahead, "capture_suit");
  const auto watch = ircp::ClockWatch::Create(*recorder, clock, log, "recorder");
  ASSERT_TRUE(responder.ok() && watch.ok());
  ASSERT_TRUE(Eventually([&] {
    const auto relations = (*watch)->relations();
    return !relations.empty() && relations[0].exchanges >= 4;
  }));
  const auto writer = WriterOf<ircp::SuitSample>(*suit, "suit");
  std::mutex mutex;
  std::string name;
  const auto reader = ReaderOf<ircp::SuitSample>(
      *recorder, [&](const ircp::SuitSample&, const Reception& reception) {
        const std::lock_guard lock(mutex);
        name = reception.writer;
      });
  ASSERT_TRUE(
      Eventually([&] { return writer->matched_readers() == 1 && reader->matched_writers() == 1; }));
  ASSERT_TRUE(writer->Write(Suit(1)).ok());
  ASSERT_TRUE(Eventually([&] {
    const std::lock_guard lock(mutex);
    return !name.empty();
  }));
  const ircp::ClockRelation relation = (*watch)->relations().at(0);
  EXPECT_EQ(relation.program, "capture_suit");
  EXPECT_EQ(relation.participant, ircp::ParticipantOf(name));
  EXPECT_LE(std::chrono::abs(relation.offset - std::chrono::seconds(5)), relation.uncertainty);
}

}  // namespace
}  // namespace exemplar::bus
