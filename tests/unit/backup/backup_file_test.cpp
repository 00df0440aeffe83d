#include "exemplar/backup/backup_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "exemplar/backup/tar.hpp"
#include "exemplar/security/digest.hpp"

namespace exemplar::backup {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class BackupFileTest : public testing::Test {
 protected:
  BackupFileTest() {
    std::string name = (fs::temp_directory_path() / "exemplar-backup-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    file_ = folder_ / "a.tar";
  }
  ~BackupFileTest() override { fs::remove_all(folder_); }

  /// Two services of one part each; the first announces `announced` bytes.
  Result<Manifest> Write(std::uint64_t announced = 5) {
    auto writer = Writer::Create(file_, Stamp::FromNanoseconds(1'700'000'000'000'000'000), "1.2");
    if (!writer) return writer.error();
    const auto learning = (*writer)->NextService({});
    api::BackupPlan plan{.service = "learning",
                         .schema = 3,
                         .parts = 1,
                         .bytes = announced,
                         .counts = {},
                         .notices = {}};
    plan.counts["trials"] = 2;
    EXPECT_TRUE(learning->Begin(plan).ok());
    EXPECT_TRUE(learning->BeginPart({"store.json", 5}).ok());
    EXPECT_TRUE(learning->Write("he").ok());
    EXPECT_TRUE(learning->Write("llo").ok());
    const auto recorder = (*writer)->NextService({});
    const std::string erased = R"([{"salt": "s", "hash": "h", "erased_ns": 7}])";
    EXPECT_TRUE(recorder
                    ->Begin({.service = "recorder",
                             .schema = 1,
                             .parts = 1,
                             .bytes = erased.size(),
                             .counts = {},
                             .notices = {"a.mcap was left out"}})
                    .ok());
    EXPECT_TRUE(recorder->BeginPart({"erased.json", erased.size()}).ok());
    EXPECT_TRUE(recorder->Write(erased).ok());
    return (*writer)->Finish();
  }

  fs::path folder_;
  fs::path file_;
};

TEST_F(BackupFileTest, SaysOfItselfWhatWasWritten) {
  ASSERT_TRUE(Write().ok());
  const auto manifest = Verify(file_, {});
  ASSERT_TRUE(manifest.ok()) << manifest.error().message;
  EXPECT_EQ(manifest->made, Stamp::FromNanoseconds(1'700'000'000'000'000'000));
  EXPECT_EQ(manifest->program, "1.2");
  ASSERT_NE(manifest->Find("learning"), nullptr);
  EXPECT_EQ(manifest->Find("learning")->counts.at("trials"), 2u);
  EXPECT_EQ(manifest->Find("recorder")->notices.at(0), "a.mcap was left out");
  EXPECT_EQ(manifest->Find("executor"), nullptr);
  ASSERT_EQ(manifest->parts.size(), 2u);
  EXPECT_EQ(manifest->parts[0].name, "learning/store.json");
  EXPECT_EQ(manifest->parts[0].sha256, security::Sha256Hex("hello"));
}

TEST_F(BackupFileTest, GivesEachServiceItsOwnParts) {
  ASSERT_TRUE(Write().ok());
  const auto manifest = Verify(file_, {});
  const auto source = OpenService(file_, *manifest, "learning", {});
  ASSERT_TRUE(source.ok());
  const auto part = (*source)->NextPart();
  ASSERT_TRUE(part.ok() && *part);
  EXPECT_EQ((*part)->name, "store.json");
  EXPECT_EQ(*(*source)->Read(), "hello");
  EXPECT_EQ(*(*source)->Read(), "");
  const auto last = (*source)->NextPart();
  ASSERT_TRUE(last.ok());
  EXPECT_FALSE(last->has_value());
}

TEST_F(BackupFileTest, PassesOverPartsThatNobodyReads) {
  ASSERT_TRUE(Write().ok());
  const auto manifest = Verify(file_, {});
  const auto source = OpenService(file_, *manifest, "recorder", {});
  ASSERT_TRUE((*source)->NextPart()->has_value());
  EXPECT_FALSE((*source)->NextPart()->has_value());
}

TEST_F(BackupFileTest, NoticesWhatChangedAfterItWasVerified) {
  ASSERT_TRUE(Write().ok());
  const auto manifest = Verify(file_, {});
  std::fstream stream(file_, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(static_cast<std::streamoff>(manifest->parts[0].offset));
  stream << "J";
  stream.close();
  const auto source = OpenService(file_, *manifest, "learning", {});
  ASSERT_TRUE((*source)->NextPart().ok());
  ASSERT_TRUE((*source)->Read().ok());
  const auto end = (*source)->Read();
  ASSERT_FALSE(end.ok());
  EXPECT_THAT(end.error().message, HasSubstr("changed since it was verified"));
  const auto verified = Verify(file_, {});
  ASSERT_FALSE(verified.ok());
  EXPECT_EQ(verified.error().code, ErrorCode::kDataLoss);
  EXPECT_THAT(verified.error().message, HasSubstr("learning/store.json is damaged"));
}

TEST_F(BackupFileTest, IsNotMadeOfLessThanWasAnnounced) {
  const auto manifest = Write(9);
  ASSERT_FALSE(manifest.ok());
  EXPECT_THAT(manifest.error().message, HasSubstr("5 bytes of 9"));
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(BackupFileTest, RefusesAManifestWhoseNumbersAreNone) {
  const auto verify = [&](const std::string& made, const std::string& schema,
                          const std::string& count) {
    const std::string text =
        R"({"format": "exemplar-backup", "format_version": 1, "program": "", "made_ns": )" + made +
        R"(, "services": [{"service": "recorder", "schema": )" + schema +
        R"(, "parts": 0, "bytes": 0, "counts": {"trials": )" + count +
        R"(}, "notices": []}], "parts": []})";
    fs::remove(file_);
    const auto tar = TarWriter::Create(file_);
    EXPECT_TRUE((*tar)->Begin("manifest.json", text.size(), 0).ok());
    EXPECT_TRUE((*tar)->Write(text).ok());
    EXPECT_TRUE((*tar)->Finish().ok());
    return Verify(file_, {});
  };
  ASSERT_TRUE(verify("7", "1", "2").ok());
  for (const char* none : {"1.5", "1e300", "\"7\"", "null", "true"}) {
    for (const auto& manifest :
         {verify(none, "1", "2"), verify("7", none, "2"), verify("7", "1", none)}) {
      ASSERT_FALSE(manifest.ok()) << none;
      EXPECT_EQ(manifest.error().code, ErrorCode::kDataLoss);
      EXPECT_THAT(manifest.error().message, HasSubstr("manifest.json: ")) << none;
    }
  }
  EXPECT_FALSE(verify("7", "1", "-2").ok());
}

TEST_F(BackupFileTest, TellsWhoWasErased) {
  ASSERT_TRUE(Write().ok());
  auto manifest = Verify(file_, {});
  ASSERT_TRUE(manifest.ok());
  // Here the learning service's rows are no JSON.
  EXPECT_EQ(ReadErased(file_, *manifest).error().code, ErrorCode::kDataLoss);
  std::erase_if(manifest->services,
                [](const api::BackupPlan& plan) { return plan.service == "learning"; });
  const auto erased = ReadErased(file_, *manifest);
  ASSERT_TRUE(erased.ok()) << erased.error().message;
  ASSERT_EQ(erased->size(), 1u);
  EXPECT_EQ(erased->at(0).hash, "h");
  EXPECT_EQ(erased->at(0).erased, Stamp::FromNanoseconds(7));
}

}  // namespace
}  // namespace exemplar::backup
