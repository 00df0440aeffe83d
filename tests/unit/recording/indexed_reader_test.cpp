#include <algorithm>
#include <limits>

#include "sample_recording.hpp"

namespace exemplar::recording {
namespace {

using ::testing::HasSubstr;

/// What a query must give: by log time, in file order where equal.
std::vector<Message> Expected(const SampleRecording& sample, const MessageQuery& query) {
  const std::string topics[] = {"", "ircp/suit", "ircp/tactile", "other"};
  std::vector<Message> expected;
  for (const Message& message : sample.messages) {
    if (query.start && message.log_time < *query.start) continue;
    if (query.end && message.log_time >= *query.end) continue;
    if (!query.topics.empty() && !query.topics.contains(topics[message.channel_id])) continue;
    expected.push_back(message);
  }
  std::stable_sort(expected.begin(), expected.end(),
                   [](const Message& a, const Message& b) { return a.log_time < b.log_time; });
  return expected;
}

std::vector<Message> Read(IndexedReader& reader, const MessageQuery& query) {
  std::vector<Message> messages;
  const Status read = reader.ReadMessages(query, [&](const Message& message) {
    messages.push_back(message);
    return true;
  });
  EXPECT_TRUE(read.ok());
  return messages;
}

TEST(IndexedReader, GivesMessagesOfAQueryInOrderOfTime) {
  Rng rng(21);
  for (const bool repeated : {true, false}) {
    WriterOptions options;
    options.chunk_bytes = 700;
    options.repeated_schemas = repeated;
    options.repeated_channels = repeated;
    const SampleRecording sample = MakeRecording(rng, 400, options);
    MemorySource source(sample.file);
    Result<std::unique_ptr<IndexedReader>> reader = IndexedReader::Open(source);
    ASSERT_TRUE(reader.ok()) << reader.error().message;
    ASSERT_TRUE((*reader)->statistics().has_value());
    EXPECT_EQ((*reader)->statistics()->message_count, 400u);
    EXPECT_EQ(Read(**reader, {}), Expected(sample, {}));
    EXPECT_EQ((*reader)->channels().size(), 3u);
    for (int i = 0; i < 20; ++i) {
      MessageQuery query;
      if (rng.Uniform() < 0.7) query.start = sample.messages[rng.Below(400)].log_time;
      if (rng.Uniform() < 0.7) query.end = sample.messages[rng.Below(400)].log_time;
      if (rng.Uniform() < 0.5) query.topics.insert("ircp/suit");
      if (rng.Uniform() < 0.3) query.topics.insert("other");
      EXPECT_EQ(Read(**reader, query), Expected(sample, query));
    }
  }
}

TEST(IndexedReader, StopsWhenTheVisitorHasEnough) {
  Rng rng(22);
  const SampleRecording sample = MakeRecording(rng, 50, {});
  MemorySource source(sample.file);
  Result<std::unique_ptr<IndexedReader>> reader = IndexedReader::Open(source);
  ASSERT_TRUE(reader.ok());
  int visited = 0;
  ASSERT_TRUE((*reader)->ReadMessages({}, [&](const Message&) { return ++visited < 7; }).ok());
  EXPECT_EQ(visited, 7);
}

TEST(IndexedReader, FindsAttachmentsAndMetadata) {
  Rng rng(23);
  const SampleRecording sample = MakeRecording(rng, 50, {.profile = "lab"});
  MemorySource source(sample.file);
  Result<std::unique_ptr<IndexedReader>> reader = IndexedReader::Open(source);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->header().profile, "lab");
  ASSERT_EQ((*reader)->attachments().size(), 1u);
  const Result<Attachment> attachment = (*reader)->ReadAttachment((*reader)->attachments()[0]);
  ASSERT_TRUE(attachment.ok());
  EXPECT_EQ(attachment->name, "note.txt");
  ASSERT_EQ((*reader)->metadata().size(), 2u);
  const Result<Metadata> metadata = (*reader)->ReadMetadata((*reader)->metadata()[1]);
  ASSERT_TRUE(metadata.ok());
  EXPECT_EQ(metadata->name, "losses");
  const Result<DataEnd> end = (*reader)->ReadDataEnd();
  ASSERT_TRUE(end.ok());
  EXPECT_NE(end->data_section_crc, 0u);
}

TEST(IndexedReader, NamesARecordingThatWasNotClosed) {
  Rng rng(24);
  const SampleRecording sample = MakeRecording(rng, 50, {}, false);
  MemorySource source(sample.file);
  const Result<std::unique_ptr<IndexedReader>> reader = IndexedReader::Open(source);
  ASSERT_FALSE(reader.ok());
  EXPECT_EQ(reader.error().code, ErrorCode::kDataLoss);
  EXPECT_THAT(reader.error().message, HasSubstr("not closed"));
}

TEST(IndexedReader, SurvivesNoiseEverywhere) {
  Rng rng(25);
  const SampleRecording sample = MakeRecording(rng, 40, {.chunk_bytes = 500});
  ReaderOptions options;
  options.check_crcs = false;
  options.largest_record_bytes = 1u << 16;
  for (int i = 0; i < 1000; ++i) {
    Bytes bad = sample.file;
    for (int flips = 0; flips < 2; ++flips) {
      bad[rng.Below(bad.size())] = static_cast<std::uint8_t>(rng.Below(256));
    }
    MemorySource source(bad);
    Result<std::unique_ptr<IndexedReader>> reader = IndexedReader::Open(source, options);
    if (!reader.ok()) continue;
    std::size_t messages = 0;
    const Status read = (*reader)->ReadMessages({}, [&](const Message&) {
      ++messages;
      return true;
    });
    if (read.ok()) {
      EXPECT_LE(messages, 2 * sample.messages.size());
    }
  }
}

TEST(IndexedReader, OrdersTimesWithoutASign) {
  MemorySink sink;
  auto writer = Writer::Create(sink, {.chunk_bytes = 40});  // a chunk a message
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE((*writer)->AddChannel({65535, 0, "t", "cdr", {}}).ok());
  const std::vector<std::int64_t> times = {5, -1, std::numeric_limits<std::int64_t>::min(), 7};
  for (const std::int64_t time : times) {
    const Stamp stamp = Stamp::FromNanoseconds(time);
    ASSERT_TRUE((*writer)->Write({65535, 0, stamp, stamp, Bytes(20)}).ok());
  }
  ASSERT_TRUE((*writer)->Close().ok());
  MemorySource source(sink.bytes());
  auto reader = IndexedReader::Open(source);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->statistics()->message_start_time.nanoseconds(), 5);
  EXPECT_EQ((*reader)->statistics()->message_end_time.nanoseconds(), -1);
  std::vector<std::int64_t> read;
  ASSERT_TRUE((*reader)
                  ->ReadMessages({},
                                 [&](const Message& message) {
                                   read.push_back(message.log_time.nanoseconds());
                                   return true;
                                 })
                  .ok());
  EXPECT_EQ(read, (std::vector<std::int64_t>{5, 7, times[2], -1}));
}

}  // namespace
}  // namespace exemplar::recording
