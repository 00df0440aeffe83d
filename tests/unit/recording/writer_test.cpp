#include "exemplar/recording/writer.hpp"

#include <tuple>

#include "sample_recording.hpp"

namespace exemplar::recording {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Fails once it holds `room` bytes; what does not fit is not written.
class FullSink final : public ByteSink {
 public:
  explicit FullSink(std::size_t room) : room_(room) {}
  Status Write(ByteView bytes) override {
    if (bytes_.size() + bytes.size() > room_) {
      return Error{ErrorCode::kResourceExhausted, "the disk is full"};
    }
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return {};
  }
  Status Sync() override { return {}; }
  const Bytes& bytes() const { return bytes_; }

 private:
  std::size_t room_;
  Bytes bytes_;
};

class RoundTrip : public ::testing::TestWithParam<std::tuple<Compression, bool, int>> {};

TEST_P(RoundTrip, GivesEveryRecordBack) {
  WriterOptions options;
  options.compression = std::get<0>(GetParam());
  options.chunks = std::get<1>(GetParam());
  options.chunk_bytes = static_cast<std::uint64_t>(std::get<2>(GetParam()));
  Rng rng(11);
  const SampleRecording sample = MakeRecording(rng, 300, options);
  const Result<std::vector<Record>> records = ReadAll(sample.file);
  ASSERT_TRUE(records.ok()) << records.error().message;
  EXPECT_EQ(Only<Message>(*records), sample.messages);
  EXPECT_EQ(Only<Schema>(*records).size(), 4u);  // once in the data, once in the summary
  EXPECT_EQ(Only<Channel>(*records).size(), 6u);
  ASSERT_EQ(Only<Attachment>(*records).size(), 1u);
  EXPECT_THAT(Only<Attachment>(*records)[0].data, ElementsAre(1, 2, 3));
  ASSERT_EQ(Only<Metadata>(*records).size(), 2u);
  EXPECT_EQ(Only<Metadata>(*records)[0].metadata.at("operator"), "Ann");
  const std::vector<Statistics> statistics = Only<Statistics>(*records);
  ASSERT_EQ(statistics.size(), 1u);
  EXPECT_EQ(statistics[0].message_count, 300u);
  EXPECT_EQ(statistics[0].chunk_count, Only<ChunkIndex>(*records).size());
}

INSTANTIATE_TEST_SUITE_P(
    All, RoundTrip,
    ::testing::Combine(::testing::Values(Compression::kNone, Compression::kZstd, Compression::kLz4),
                       ::testing::Bool(), ::testing::Values(1, 2000, 1 << 20)));

TEST(Writer, RefusesWhatDoesNotFitTogether) {
  MemorySink sink;
  Result<std::unique_ptr<Writer>> created = Writer::Create(sink);
  ASSERT_TRUE(created.ok());
  Writer& writer = **created;
  EXPECT_THAT(writer.AddSchema({0, "s", "omgidl", {}}).error().message, HasSubstr("id 0"));
  EXPECT_THAT(writer.AddChannel({1, 9, "t", "cdr", {}}).error().message,
              HasSubstr("schema 9 was not added"));
  EXPECT_THAT(writer.Write(Message{4, 0, {}, {}, {}}).error().message,
              HasSubstr("channel 4 was not added"));
  ASSERT_TRUE(writer.AddSchema({1, "s", "omgidl", {1}}).ok());
  EXPECT_TRUE(writer.AddSchema({1, "s", "omgidl", {1}}).ok());
  EXPECT_EQ(writer.statistics().schema_count, 1);
  EXPECT_FALSE(writer.AddSchema({1, "s", "omgidl", {2}}).ok());
  ASSERT_TRUE(writer.AddChannel({1, 1, "t", "cdr", {}}).ok());
  EXPECT_FALSE(writer.AddChannel({1, 1, "u", "cdr", {}}).ok());
  ASSERT_TRUE(writer.Close().ok());
  EXPECT_THAT(writer.Write(Message{1, 0, {}, {}, {}}).error().message, HasSubstr("closed"));
}

TEST(Writer, RefusesOptionsOutOfRange) {
  MemorySink sink;
  EXPECT_EQ(Writer::Create(sink, {.chunk_bytes = 0}).error().field, "chunk_bytes");
  EXPECT_EQ(Writer::Create(sink, {.zstd_level = 40}).error().field, "zstd_level");
  EXPECT_TRUE(sink.bytes().empty());
}

TEST(Writer, SyncsAllMessagesOnFlush) {
  MemorySink sink;
  Result<std::unique_ptr<Writer>> writer = Writer::Create(sink);
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE((*writer)->AddChannel({1, 0, "t", "cdr", {}}).ok());
  ASSERT_TRUE((*writer)->Write(Message{1, 1, {}, {}, {42}}).ok());
  ASSERT_TRUE((*writer)->Flush().ok());
  EXPECT_EQ(sink.synced(), sink.bytes().size());
  EXPECT_EQ((*writer)->statistics().chunk_count, 1u);
}

TEST(Writer, StopsAtAFullSinkWithWholeRecords) {
  for (const std::size_t room : {10u, 200u, 1500u, 4000u}) {
    FullSink sink(room);
    Result<std::unique_ptr<Writer>> writer = Writer::Create(sink, {.chunk_bytes = 500});
    if (!writer.ok()) {
      EXPECT_EQ(writer.error().code, ErrorCode::kResourceExhausted);
      continue;
    }
    ASSERT_TRUE((*writer)->AddChannel({1, 0, "t", "cdr", {}}).ok());
    Status status;
    Rng rng(4);
    for (int i = 0; i < 1000 && status.ok(); ++i) {
      Bytes data(20);
      for (std::uint8_t& byte : data) byte = static_cast<std::uint8_t>(rng.Below(256));
      status = (*writer)->Write(Message{1, 0, {}, {}, data});
    }
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::kResourceExhausted);
    EXPECT_EQ((*writer)->Close().error(), status.error());
    EXPECT_THAT(ReadAll(sink.bytes()).error().message,
                HasSubstr("at byte " + std::to_string(sink.bytes().size())));
  }
}

TEST(StreamReader, NamesThePlaceOfEveryFlippedBit) {
  Rng rng(9);
  const SampleRecording sample = MakeRecording(rng, 20, {.chunk_bytes = 600});
  ReaderOptions options;
  options.largest_record_bytes = 1u << 20;
  const Result<std::vector<Record>> good = ReadAll(sample.file, options);
  ASSERT_TRUE(good.ok());
  int unnoticed = 0;
  for (std::size_t i = 0; i < sample.file.size(); ++i) {
    Bytes bad = sample.file;
    bad[i] ^= 0x10;
    const Result<std::vector<Record>> records = ReadAll(bad, options);
    if (records.ok()) ++unnoticed;
  }
  EXPECT_EQ(unnoticed, 0);
}

TEST(StreamReader, NamesAFileThatIsNone) {
  EXPECT_THAT(ReadAll({}).error().message, HasSubstr("is empty"));
  EXPECT_THAT(ReadAll(Bytes(100, 'x')).error().message, HasSubstr("does not begin"));
}

TEST(StreamReader, RefusesRecordsBeyondTheLimit) {
  Rng rng(5);
  const SampleRecording sample = MakeRecording(rng, 100, {});
  EXPECT_THAT(ReadAll(sample.file, {.largest_record_bytes = 64}).error().message,
              HasSubstr("claims"));
}

}  // namespace
}  // namespace exemplar::recording
