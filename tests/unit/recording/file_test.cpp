#include "exemplar/recording/file.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "exemplar/recording/recover.hpp"
#include "sample_recording.hpp"

namespace exemplar::recording {
namespace {

class FileTest : public ::testing::Test {
 protected:
  FileTest() {
    std::string name = (std::filesystem::temp_directory_path() / "exemplar-file-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~FileTest() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

Bytes Slurp(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(stream), {});
}

TEST_F(FileTest, WritesTheSameBytesAsMemory) {
  Rng rng(41);
  const SampleRecording sample = MakeRecording(rng, 50, {});
  const std::filesystem::path path = folder_ / "a.mcap";
  {
    Result<std::unique_ptr<FileSink>> sink = FileSink::Create(path);
    ASSERT_TRUE(sink.ok()) << sink.error().message;
    ASSERT_TRUE((*sink)->Write(sample.file).ok());
    ASSERT_TRUE((*sink)->Sync().ok());
    EXPECT_EQ((*sink)->size(), sample.file.size());
  }
  EXPECT_EQ(Slurp(path), sample.file);
  Result<std::unique_ptr<FileSource>> source = FileSource::Open(path);
  ASSERT_TRUE(source.ok());
  EXPECT_EQ((*source)->size(), sample.file.size());
  Bytes middle(10);
  EXPECT_EQ(*(*source)->Read(20, middle), 10u);
  EXPECT_TRUE(std::equal(middle.begin(), middle.end(), sample.file.begin() + 20));
  EXPECT_EQ(*(*source)->Read(sample.file.size() - 4, middle), 4u);
  EXPECT_EQ(*(*source)->Read(sample.file.size() + 4, middle), 0u);
}

TEST_F(FileTest, NeverOverwritesARecording) {
  const std::filesystem::path path = folder_ / "a.mcap";
  const Result<std::unique_ptr<FileSink>> first = FileSink::Create(path);
  ASSERT_TRUE(first.ok());
  const Result<std::unique_ptr<FileSink>> second = FileSink::Create(path);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kAlreadyExists);
  EXPECT_THAT(second.error().message, ::testing::HasSubstr(path.string()));
}

TEST_F(FileTest, NamesAMissingFolderAndAMissingFile) {
  EXPECT_EQ(FileSink::Create(folder_ / "none" / "a.mcap").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(FileSource::Open(folder_ / "none.mcap").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(FileSource::Open(folder_).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(FileTest, EndsAtAWholeWriteWhenThereIsNoMoreRoom) {
  // A limit on file sizes stands in for the full disk: write() fails half way in the same manner.
  const std::filesystem::path path = folder_ / "a.mcap";
  Result<std::unique_ptr<FileSink>> sink = FileSink::Create(path);
  ASSERT_TRUE(sink.ok());
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 5000;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const Bytes block(3000, 7);
  const Status first = (*sink)->Write(block);
  const Status second = (*sink)->Write(block);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_TRUE(first.ok());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kResourceExhausted);
  EXPECT_EQ(Slurp(path), block);
  EXPECT_TRUE((*sink)->Write(block).ok());
  EXPECT_EQ(Slurp(path).size(), 6000u);
}

TEST_F(FileTest, WritesTheSameFileWithIndexesOnDiskAsInMemory) {
  // A chunk a message: about 100 kB of indexes, more than the writer keeps in memory.
  const auto write = [](std::unique_ptr<ByteScratch> scratch) {
    MemorySink sink;
    Result<std::unique_ptr<Writer>> writer =
        Writer::Create(sink, {.chunk_bytes = 1}, std::move(scratch));
    EXPECT_TRUE(writer.ok());
    EXPECT_TRUE((*writer)->AddChannel({1, 0, "t", "cdr", {}}).ok());
    for (std::uint32_t i = 0; i < 1200; ++i) {
      EXPECT_TRUE((*writer)->Write(Message{1, i, {}, {}, {1, 2, 3}}).ok());
    }
    EXPECT_TRUE((*writer)->Close().ok());
    return sink.bytes();
  };
  Result<std::unique_ptr<FileScratch>> scratch = FileScratch::Create(folder_);
  ASSERT_TRUE(scratch.ok()) << scratch.error().message;
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
  const Bytes on_disk = write(std::move(*scratch));
  EXPECT_EQ(on_disk, write(nullptr));
  MemorySource source(on_disk);
  const Result<std::unique_ptr<IndexedReader>> reader = IndexedReader::Open(source);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_EQ((*reader)->chunks().size(), 1200u);
}

}  // namespace
}  // namespace exemplar::recording
