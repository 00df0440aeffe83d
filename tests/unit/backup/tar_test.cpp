#include "exemplar/backup/tar.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <vector>

#include "exemplar/base/rng.hpp"

namespace exemplar::backup {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class TarTest : public testing::Test {
 protected:
  TarTest() {
    std::string name = (fs::temp_directory_path() / "exemplar-tar-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    file_ = folder_ / "a.tar";
  }
  ~TarTest() override { fs::remove_all(folder_); }

  struct Entry {
    std::string name;
    std::string bytes;
  };
  void Write(const std::vector<Entry>& entries) {
    fs::remove(file_);
    auto writer = TarWriter::Create(file_);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    for (const Entry& entry : entries) {
      ASSERT_TRUE((*writer)->Begin(entry.name, entry.bytes.size(), 1'700'000'000).ok());
      ASSERT_TRUE((*writer)->Write(entry.bytes).ok());
    }
    const Status finished = (*writer)->Finish();
    ASSERT_TRUE(finished.ok()) << finished.error().message;
  }
  Result<std::vector<Entry>> Read() {
    auto reader = TarReader::Open(file_);
    if (!reader) return reader.error();
    std::vector<Entry> entries;
    for (;;) {
      const auto entry = (*reader)->Next();
      if (!entry) return entry.error();
      if (!*entry) return entries;
      entries.push_back({(*entry)->name, ""});
      for (;;) {
        const auto bytes = (*reader)->Read();
        if (!bytes) return bytes.error();
        if (bytes->empty()) break;
        entries.back().bytes += *bytes;
      }
    }
  }
  std::string Slurp() const {
    std::ifstream stream(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void Put(const std::string& bytes) const {
    // Some file systems write a file out at once that is cut and filled again.
    fs::remove(file_);
    std::ofstream(file_, std::ios::binary | std::ios::trunc) << bytes;
  }

  fs::path folder_;
  fs::path file_;
};

std::string RandomBytes(Rng& rng, std::size_t size) {
  std::string bytes(size, '\0');
  for (char& c : bytes) c = static_cast<char>(rng.Below(256));
  return bytes;
}

TEST_F(TarTest, GivesBackWhatWasWritten) {
  Rng rng(7);
  const std::vector<Entry> entries = {{"empty", ""},
                                      {"a/b.json", "{}"},
                                      {"block", RandomBytes(rng, 512)},
                                      {"large.bin", RandomBytes(rng, 700'001)},
                                      {std::string(99, 'n'), "99"},
                                      {std::string(100, 'n'), "100"},
                                      {"recordings/" + std::string(200, 'n') + ".mcap", "long"}};
  Write(entries);
  const auto read = Read();
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->size(), entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    EXPECT_EQ((*read)[i].name, entries[i].name);
    EXPECT_EQ((*read)[i].bytes, entries[i].bytes);
  }
  EXPECT_EQ(Slurp().size() % 512, 0u);
}

TEST_F(TarTest, IsTakenByTheSystemsTar) {
  const std::string name = "recordings/" + std::string(200, 'n') + ".mcap";
  Write({{"a.json", "{\"a\": 1}"}, {name, "long"}});
  const std::string command = "tar -C '" + folder_.string() + "' -xf '" + file_.string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::ifstream stream(folder_ / name);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}), "long");
}

TEST_F(TarTest, RefusesEveryCutWithItsPlace) {
  Rng rng(3);
  Write({{"first", RandomBytes(rng, 600)}, {"second", RandomBytes(rng, 100)}});
  const std::string whole = Slurp();
  for (std::size_t size = 0; size < whole.size(); size += 37) {
    Put(whole.substr(0, size));
    const auto read = Read();
    ASSERT_FALSE(read.ok()) << size;
    EXPECT_EQ(read.error().code, ErrorCode::kDataLoss);
    EXPECT_THAT(read.error().message, HasSubstr("byte " + std::to_string(size) + ":"));
  }
}

TEST_F(TarTest, RefusesEveryDamagedByteOfAHeader) {
  Write({{"first", "some bytes"}});
  const std::string whole = Slurp();
  for (std::size_t i = 0; i < 512; ++i) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x15);
    Put(damaged);
    const auto read = Read();
    // Within the checksum's own field a blank more or less means the same number.
    if (read.ok()) {
      EXPECT_GE(i, 148u);
      EXPECT_LT(i, 156u);
      EXPECT_EQ((*read)[0].bytes, "some bytes");
    }
  }
}

TEST_F(TarTest, SurvivesAnyBytes) {
  Rng rng(11);
  Write({{std::string(150, 'x'), RandomBytes(rng, 300)}, {"b", RandomBytes(rng, 30)}});
  const std::string whole = Slurp();
  for (int round = 0; round < 300; ++round) {
    std::string damaged = whole;
    for (int k = 0; k < 3; ++k) {
      damaged[rng.Below(damaged.size())] = static_cast<char>(rng.Below(256));
    }
    Put(damaged);
    const auto read = Read();
    if (!read.ok()) {
      EXPECT_EQ(read.error().code, ErrorCode::kDataLoss);
    }
  }
}

/// As backup_fuzz does at length: behind a wrong checksum nothing else of a header is looked at.
TEST_F(TarTest, SurvivesAnyHeaderWithTheRightChecksum) {
  Rng rng(12);
  Write({{std::string(150, 'x'), RandomBytes(rng, 300)}, {"b", RandomBytes(rng, 30)}});
  const std::string whole = Slurp();
  constexpr std::size_t kBlock = 512;
  constexpr std::size_t kChecksum = 148;
  int taken = 0;
  for (int round = 0; round < 1000; ++round) {
    std::string damaged = whole;
    const std::size_t header =
        kBlock * 2 * rng.Below(3);  // of the pax record, the first, the second
    for (int k = 0; k < 2; ++k) {
      damaged[header + rng.Below(kBlock)] = static_cast<char>(rng.Below(256));
    }
    damaged.replace(header + kChecksum, 8, 8, ' ');
    unsigned sum = 0;
    for (std::size_t i = 0; i < kBlock; ++i) {
      sum += static_cast<unsigned char>(damaged[header + i]);
    }
    for (std::size_t i = 6; i-- > 0; sum /= 8) {
      damaged[header + kChecksum + i] = static_cast<char>('0' + sum % 8);
    }
    Put(damaged);
    const auto read = Read();
    taken += read.ok() ? 1 : 0;
    if (!read.ok()) {
      ASSERT_EQ(read.error().code, ErrorCode::kDataLoss);
    }
  }
  EXPECT_GT(taken, 0);
}

TEST_F(TarTest, RefusesPaxRecordsThatAreNone) {
  Write({{std::string(150, 'x'), "some bytes"}});
  const std::string whole = Slurp();
  ASSERT_EQ(whole.substr(512, 9), "160 path=");
  for (const std::string_view begin :
       {"159 path=", "161 path=", "-60 path=", "1e2 path=", " 60 path=", "111111111",
        "999999999999999999999 ", "160\npath="}) {
    std::string damaged = whole;
    damaged.replace(512, begin.size(), begin);
    Put(damaged);
    const auto read = Read();
    ASSERT_FALSE(read.ok()) << begin;
    EXPECT_THAT(read.error().message, HasSubstr("byte 0: the pax record here is damaged")) << begin;
  }
  std::string damaged = whole;
  damaged.replace(512, 160, std::string(160, '1'));
  Put(damaged);
  EXPECT_FALSE(Read().ok());
}

TEST_F(TarTest, IsNeverWrittenOverWhatIsThere) {
  Put("mine");
  EXPECT_EQ(TarWriter::Create(file_).error().code, ErrorCode::kAlreadyExists);
  EXPECT_EQ(Slurp(), "mine");
}

TEST_F(TarTest, LeavesNothingWhenItIsNotFinished) {
  {
    auto writer = TarWriter::Create(file_);
    ASSERT_TRUE(writer.ok());
    ASSERT_TRUE((*writer)->Begin("a", 4, 0).ok());
    EXPECT_FALSE((*writer)->Write("too long").ok());
    ASSERT_TRUE((*writer)->Write("abc").ok());
    EXPECT_FALSE((*writer)->Finish().ok());
  }
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace exemplar::backup
