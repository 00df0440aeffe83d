#include "exemplar/recording/recover.hpp"

#include "sample_recording.hpp"

namespace exemplar::recording {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

struct Recovered {
  RecoveryReport report;
  std::vector<Message> messages;
};

Recovered MustRecover(ByteView damaged) {
  MemorySource source(damaged);
  MemorySink sink;
  Result<RecoveryReport> report = Recover(source, sink, {.compression = Compression::kNone});
  EXPECT_TRUE(report.ok()) << report.error().message;
  if (!report.ok()) return {};
  const Result<std::vector<Record>> records = ReadAll(sink.bytes());
  EXPECT_TRUE(records.ok()) << records.error().message;
  if (!records.ok()) return {};
  EXPECT_EQ(Only<Message>(*records).size(), report->messages);
  return {*report, Only<Message>(*records)};
}

/// The messages whose records end at or before each offset, from a file without compression.
std::vector<std::size_t> MessagesBefore(const Bytes& file) {
  std::vector<std::size_t> whole(file.size() + 1, 0);
  std::size_t offset = sizeof kMagic;
  const auto length = [&](std::size_t at) {
    std::uint64_t v = 0;
    for (int i = 8; i > 0; --i) v = (v << 8) | file[at + static_cast<std::size_t>(i)];
    return static_cast<std::size_t>(v);
  };
  std::size_t count = 0;
  const auto step = [&](std::size_t end) {
    for (std::size_t i = end; i <= file.size(); ++i) whole[i] = count;
  };
  while (offset + 9 < file.size() - sizeof kMagic) {
    const std::size_t end = offset + 9 + length(offset);
    if (file[offset] == static_cast<std::uint8_t>(Opcode::kMessage)) {
      ++count;
      step(end);
    } else if (file[offset] == static_cast<std::uint8_t>(Opcode::kChunk)) {
      for (std::size_t inner = offset + 9 + 40; inner < end; inner += 9 + length(inner)) {
        if (file[inner] != static_cast<std::uint8_t>(Opcode::kMessage)) continue;
        ++count;
        step(inner + 9 + length(inner));
      }
    }
    offset = end;
  }
  return whole;
}

TEST(Recover, RestoresEveryWholeMessageOfAFileCutAtAnyByte) {
  for (const bool chunks : {true, false}) {
    Rng rng(31);
    const SampleRecording sample = MakeRecording(
        rng, 25, {.chunks = chunks, .chunk_bytes = 500, .compression = Compression::kNone});
    const std::vector<std::size_t> whole = MessagesBefore(sample.file);
    ASSERT_EQ(whole.back(), sample.messages.size());
    for (std::size_t size = sizeof kMagic; size <= sample.file.size(); ++size) {
      const Recovered recovered = MustRecover(ByteView(sample.file).first(size));
      ASSERT_EQ(recovered.messages.size(), whole[size]) << "cut at byte " << size;
      EXPECT_TRUE(std::equal(recovered.messages.begin(), recovered.messages.end(),
                             sample.messages.begin()));
      EXPECT_EQ(recovered.report.was_whole, size >= sample.file.size() - sizeof kMagic);
    }
  }
}

TEST(Recover, RestoresTheBeginningOfACutCompressedChunk) {
  for (const Compression compression : {Compression::kZstd, Compression::kLz4}) {
    Rng rng(32);
    const SampleRecording sample =
        MakeRecording(rng, 20'000, {.chunk_bytes = 1u << 30, .compression = compression});
    const Recovered recovered = MustRecover(ByteView(sample.file).first(sample.file.size() / 3));
    EXPECT_GT(recovered.messages.size(), sample.messages.size() / 6);
    EXPECT_LT(recovered.messages.size(), sample.messages.size());
    EXPECT_TRUE(
        std::equal(recovered.messages.begin(), recovered.messages.end(), sample.messages.begin()));
    EXPECT_THAT(recovered.report.notices, Not(IsEmpty()));
  }
}

TEST(Recover, CopiesAWholeFileAndSaysSo) {
  Rng rng(33);
  const SampleRecording sample = MakeRecording(rng, 100, {.profile = "lab", .chunk_bytes = 900});
  MemorySource source(sample.file);
  MemorySink sink;
  const Result<RecoveryReport> report = Recover(source, sink, {.chunk_bytes = 900});
  ASSERT_TRUE(report.ok());
  EXPECT_TRUE(report->was_whole);
  EXPECT_EQ(report->attachments, 1u);
  EXPECT_EQ(report->metadata, 2u);
  EXPECT_EQ(report->bytes_left_out, 0u);
  EXPECT_EQ(sink.bytes(), sample.file);
}

TEST(Recover, LeavesOutADamagedChunkAndKeepsTheOthers) {
  Rng rng(34);
  const SampleRecording sample = MakeRecording(rng, 200, {.chunk_bytes = 1000});
  MemorySource source(sample.file);
  Result<std::unique_ptr<IndexedReader>> reader = IndexedReader::Open(source);
  ASSERT_TRUE(reader.ok());
  ASSERT_GT((*reader)->chunks().size(), 5u);
  const ChunkIndex& bad_chunk = (*reader)->chunks()[3];
  const Result<std::vector<Record>> lost = (*reader)->ReadChunk(bad_chunk);
  ASSERT_TRUE(lost.ok());
  Bytes bad = sample.file;
  bad[bad_chunk.chunk_start_offset + bad_chunk.chunk_length - 10] ^= 0xFF;
  const Recovered recovered = MustRecover(bad);
  EXPECT_EQ(recovered.report.damaged_chunks, 1u);
  EXPECT_FALSE(recovered.report.was_whole);
  EXPECT_EQ(recovered.messages.size(), sample.messages.size() - Only<Message>(*lost).size());
  EXPECT_THAT(
      recovered.report.notices,
      ::testing::Contains(HasSubstr("at byte " + std::to_string(bad_chunk.chunk_start_offset))));
}

TEST(Recover, RefusesWhatIsNoRecording) {
  MemorySink sink;
  MemorySource empty{ByteView()};
  EXPECT_THAT(Recover(empty, sink).error().message, HasSubstr("is empty"));
  const Bytes text(200, 'x');
  MemorySource other(text);
  EXPECT_THAT(Recover(other, sink).error().message, HasSubstr("does not begin"));
  EXPECT_TRUE(sink.bytes().empty());
}

TEST(Recover, SurvivesNoiseEverywhere) {
  Rng rng(35);
  const SampleRecording sample =
      MakeRecording(rng, 40, {.chunk_bytes = 500, .compression = Compression::kLz4});
  for (int i = 0; i < 500; ++i) {
    Bytes bad = sample.file;
    for (int flips = 0; flips < 3; ++flips) {
      bad[sizeof kMagic + rng.Below(bad.size() - sizeof kMagic)] =
          static_cast<std::uint8_t>(rng.Below(256));
    }
    MustRecover(bad);
  }
}

}  // namespace
}  // namespace exemplar::recording
