#include "exemplar/recording/append.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>

#include "exemplar/recording/file.hpp"
#include "exemplar/recording/reader.hpp"
#include "exemplar/recording/recover.hpp"
#include "exemplar/recording/writer.hpp"
#include "record_codec.hpp"

namespace exemplar::recording {
namespace {

const Metadata kLabels{"exemplar.labels", {{"success", "yes"}, {"phase", "press"}}};

void Record(ByteSink& sink, WriterOptions options) {
  options.chunk_bytes = 200;
  auto writer = Writer::Create(sink, options);
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE((*writer)->Write(Metadata{"exemplar.recording", {{"name", "a"}}}).ok());
  ASSERT_TRUE((*writer)->AddSchema({1, "T", "omgidl", {'s'}}).ok());
  ASSERT_TRUE((*writer)->AddChannel({1, 1, "topic", "cdr", {}}).ok());
  for (std::uint32_t i = 0; i < 50; ++i) {
    const Bytes data(20, static_cast<std::uint8_t>(i));
    const Stamp stamp = Stamp::FromNanoseconds(i + 1);
    ASSERT_TRUE((*writer)->Write(MessageView{1, i, stamp, stamp, data}).ok());
  }
  ASSERT_TRUE((*writer)->Close().ok());
}

Bytes WithTail(const Bytes& bytes, const FileTail& tail) {
  Bytes whole(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(tail.offset));
  whole.insert(whole.end(), tail.bytes.begin(), tail.bytes.end());
  return whole;
}

/// All records in file order, with every CRC checked.
std::vector<recording::Record> ReadAll(const Bytes& bytes) {
  MemorySource source(bytes);
  auto reader = StreamReader::Create(source);
  EXPECT_TRUE(reader.ok());
  std::vector<recording::Record> records;
  while (true) {
    auto record = (*reader)->Next();
    EXPECT_TRUE(record.ok()) << record.error().message;
    if (!record.ok() || !record->has_value()) return records;
    records.push_back(std::move(**record));
  }
}

class AppendTest : public testing::Test {
 protected:
  AppendTest() {
    std::string pattern = (std::filesystem::temp_directory_path() / "append-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
    path_ = folder_ / "a.mcap";
    journal_ = folder_ / "a.mcap.tail";
  }
  ~AppendTest() override { std::filesystem::remove_all(folder_); }

  void Create() {
    auto sink = FileSink::Create(path_);
    ASSERT_TRUE(sink.ok());
    Record(**sink, {});
  }
  Bytes Slurp(const std::filesystem::path& path) const {
    std::ifstream stream(path, std::ios::binary);
    return Bytes(std::istreambuf_iterator<char>(stream), {});
  }
  void Put(const std::filesystem::path& path, ByteView bytes) const {
    std::ofstream stream(path, std::ios::binary | std::ios::trunc);
    stream.write(reinterpret_cast<const char*>(bytes.data()),
                 static_cast<std::streamsize>(bytes.size()));
  }

  std::filesystem::path folder_, path_, journal_;
};

TEST_F(AppendTest, IsWhatAWriterWouldHaveWritten) {
  for (const Compression compression : {Compression::kNone, Compression::kZstd}) {
    WriterOptions options;
    options.compression = compression;
    MemorySink without;
    Record(without, options);
    MemorySource source(without.bytes());
    const auto tail = TailWithMetadata(source, kLabels);
    ASSERT_TRUE(tail.ok()) << tail.error().message;
    const Bytes labelled = WithTail(without.bytes(), *tail);
    EXPECT_EQ(ReadAll(labelled).size(), ReadAll(without.bytes()).size() + 2);  // and its index
    MemorySource again(labelled);
    auto reader = IndexedReader::Open(again);
    ASSERT_TRUE(reader.ok()) << reader.error().message;
    EXPECT_EQ((*reader)->statistics()->metadata_count, 2u);
    ASSERT_EQ((*reader)->metadata().size(), 2u);
    const auto read = (*reader)->ReadMetadata((*reader)->metadata()[1]);
    ASSERT_TRUE(read.ok());
    EXPECT_EQ(*read, kLabels);
    EXPECT_NE((*reader)->ReadDataEnd()->data_section_crc, 0u);
    int messages = 0;
    ASSERT_TRUE((*reader)
                    ->ReadMessages({},
                                   [&](const Message&) {
                                     ++messages;
                                     return true;
                                   })
                    .ok());
    EXPECT_EQ(messages, 50);
  }
}

TEST_F(AppendTest, KeepsFilesWithoutSummaryOrCrcsAsPlainAsTheyAre) {
  for (int features = 0; features < 64; ++features) {
    WriterOptions options;
    options.chunks = (features & 1) != 0;
    options.statistics = (features & 2) != 0;
    options.metadata_indexes = (features & 4) != 0;
    options.summary_crc = options.data_crc = (features & 8) != 0;
    options.summary_offsets = (features & 16) != 0;
    options.repeated_schemas = options.repeated_channels = (features & 32) != 0;
    options.chunk_indexes = options.message_indexes = options.chunks;
    MemorySink without;
    Record(without, options);
    MemorySource source(without.bytes());
    const auto tail = TailWithMetadata(source, kLabels);
    ASSERT_TRUE(tail.ok()) << features << tail.error().message;
    const Bytes labelled = WithTail(without.bytes(), *tail);
    MemorySource cut_source(labelled);
    MemorySink recovered;
    const auto report = Recover(cut_source, recovered);
    ASSERT_TRUE(report.ok());
    EXPECT_TRUE(report->was_whole) << features;
    EXPECT_EQ(report->messages, 50u);
    EXPECT_EQ(report->metadata, 2u);
  }
}

TEST_F(AppendTest, ChangesTheFileInPlaceAndAgain) {
  Create();
  const Bytes before = Slurp(path_);
  ASSERT_TRUE(AppendMetadata(path_, kLabels).ok());
  ASSERT_TRUE(AppendMetadata(path_, {"exemplar.labels", {{"success", "no"}}}).ok());
  EXPECT_FALSE(std::filesystem::exists(journal_));
  const Bytes after = Slurp(path_);
  MemorySource source(before);
  const auto tail = TailWithMetadata(source, kLabels);
  EXPECT_TRUE(
      std::equal(before.begin(), before.begin() + static_cast<long>(tail->offset), after.begin()));
  MemorySource again(after);
  EXPECT_EQ((*IndexedReader::Open(again))->metadata().size(), 3u);
}

TEST_F(AppendTest, SurvivesAKillAtEveryByteThatItWrites) {
  Create();
  const Bytes before = Slurp(path_);
  MemorySource source(before);
  const auto tail = TailWithMetadata(source, kLabels);
  ASSERT_TRUE(tail.ok());
  const Bytes after = WithTail(before, *tail);
  // A journal as AppendMetadata makes it: taken from one that cannot go on.
  Bytes journal;
  const auto number = [&](std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) journal.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  };
  number(tail->offset, 8);
  number(tail->bytes.size(), 8);
  number(Crc32(0, tail->bytes), 4);
  journal.insert(journal.end(), tail->bytes.begin(), tail->bytes.end());

  for (std::size_t length = 0; length < journal.size(); ++length) {  // the journal is not whole
    Put(path_, before);
    Put(journal_, ByteView(journal).first(length));
    ASSERT_TRUE(FinishAppend(path_).ok());
    ASSERT_EQ(Slurp(path_), before) << length;
    ASSERT_FALSE(std::filesystem::exists(journal_));
  }
  for (std::size_t written = 0; written <= tail->bytes.size(); ++written) {  // the file is not
    Bytes half = before;
    if (half.size() < tail->offset + written) half.resize(tail->offset + written);
    std::copy_n(tail->bytes.begin(), written,
                half.begin() + static_cast<std::ptrdiff_t>(tail->offset));
    Put(path_, half);
    Put(journal_, journal);
    ASSERT_TRUE(FinishAppend(path_).ok());
    ASSERT_EQ(Slurp(path_), after) << written;
  }
}

TEST_F(AppendTest, RefusesWhatWasNotClosedAndLeavesItAlone) {
  Create();
  Bytes cut = Slurp(path_);
  cut.resize(cut.size() - 20);
  Put(path_, cut);
  const Status refused = AppendMetadata(path_, kLabels);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kDataLoss);
  EXPECT_NE(refused.error().message.find("a.mcap"), std::string::npos);
  EXPECT_EQ(Slurp(path_), cut);
  EXPECT_FALSE(std::filesystem::exists(journal_));
  EXPECT_EQ(AppendMetadata(folder_ / "absent.mcap", kLabels).error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace exemplar::recording
