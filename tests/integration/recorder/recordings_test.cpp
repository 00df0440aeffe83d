#include "recorder/recordings.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "exemplar/recording/append.hpp"
#include "recorder_fixture.hpp"

namespace exemplar::recorder {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct KeptParts final : api::BackupSink {
  api::BackupPlan plan;
  std::vector<std::pair<std::string, std::string>> parts;

  Status Begin(const api::BackupPlan& announced) override {
    plan = announced;
    return {};
  }
  Status BeginPart(const api::BackupPart& part) override {
    parts.emplace_back(part.name, "");
    return {};
  }
  Status Write(std::string_view bytes) override {
    parts.back().second += bytes;
    return {};
  }
};

class ReturningParts final : public api::BackupSource {
 public:
  explicit ReturningParts(std::vector<std::pair<std::string, std::string>> parts)
      : parts_(std::move(parts)) {}
  Result<std::optional<api::BackupPart>> NextPart() override {
    if (next_ == parts_.size()) return std::optional<api::BackupPart>();
    const auto& [name, bytes] = parts_[next_++];
    left_ = bytes;
    return std::optional(api::BackupPart{name, bytes.size()});
  }
  Result<std::string> Read() override { return std::exchange(left_, {}); }

 private:
  std::vector<std::pair<std::string, std::string>> parts_;
  std::size_t next_ = 0;
  std::string left_;
};

/// Days to keep, none where absent.
api::RetentionRequest Keeping(std::optional<double> days, bool dry_run = false) {
  api::RetentionRequest request;
  request.keep_days = days;
  request.dry_run = dry_run;
  return request;
}

class RecordingsTest : public RecorderTest {
 protected:
  void OpenAll(double keep_days = 0) {
    Open();
    auto made =
        Recordings::Create(*recorder_, clock_, log_, {.data_dir = folder_, .keep_days = keep_days});
    ASSERT_TRUE(made.ok());
    recordings_ = std::move(*made);
  }
  ~RecordingsTest() override { recordings_.reset(); }

  void Begin(const std::string& name, const std::string& person) {
    api::RecordStart start;
    start.name = name;
    if (!person.empty()) start.metadata["person"] = person;
    const auto started = recorder_->Start(start);
    ASSERT_TRUE(started.ok()) << started.error().message;
    for (int i = 0; i < 20; ++i) bus_.Publish(kSuit, "suit");
  }
  void Record(const std::string& name, const std::string& person) {
    Begin(name, person);
    MustStop();
  }
  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
      if (entry.is_regular_file()) names.push_back(entry.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }
  static std::vector<std::string> Names(const Result<api::DataReport>& report,
                                        const std::string& action) {
    std::vector<std::string> names;
    EXPECT_TRUE(report.ok()) << report.error().message;
    if (!report.ok()) return names;
    for (const api::DataItem& item : report->items) {
      if (item.action == action) names.push_back(item.name);
    }
    return names;
  }
  KeptParts BackUp() {
    KeptParts kept;
    const Status done = recordings_->Backup(kept, {});
    EXPECT_TRUE(done.ok()) << done.error().message;
    return kept;
  }
  Result<api::DataReport> Restore(const KeptParts& kept, api::RestoreMode mode) {
    ReturningParts source(kept.parts);
    return recordings_->Restore({.plan = kept.plan, .mode = mode, .erased = {}}, source);
  }

  std::unique_ptr<Recordings> recordings_;
};

TEST_F(RecordingsTest, KnowWhoseTheyAre) {
  OpenAll();
  Record("a", "ann");
  Record("b", "");
  Record("c", "ben");
  // A label counts more than what was said at the start.
  ASSERT_TRUE(
      recording::AppendMetadata(PathOf("c"), {"exemplar.labels", {{"person", "ann"}}}).ok());
  const auto persons = recordings_->ListPersons();
  ASSERT_TRUE(persons.ok());
  ASSERT_EQ(persons->size(), 2u);
  EXPECT_EQ(persons->at(0).person, "");
  EXPECT_EQ(persons->at(1).person, "ann");
  EXPECT_EQ(persons->at(1).items, 2u);
}

TEST_F(RecordingsTest, ThoseOfOnePersonAreErasedWhereverTheyStand) {
  OpenAll();
  Record("a", "ann");
  Record("b", "ben");
  std::filesystem::create_directory(folder_ / "moved");
  Record("m", "ann");
  std::filesystem::rename(PathOf("m"), folder_ / "moved" / "m.mcap");
  // One that nobody ended.
  Begin("cut", "ann");
  ASSERT_TRUE(recorder_->GetStatus().ok());
  std::filesystem::copy_file(PathOf("cut"), PathOf("killed"));
  MustStop();
  EXPECT_THAT(Names(recordings_->Erase({.person = "ann", .dry_run = true}, {}, {}), "deleted"),
              ElementsAre("a.mcap", "cut.mcap", "killed.mcap", "moved/m.mcap"));
  EXPECT_EQ(Files().size(), 5u);
  EXPECT_EQ(Names(recordings_->Erase({.person = "ann"}, {}, {}), "deleted").size(), 4u);
  EXPECT_THAT(Files(), ElementsAre("b.mcap", "erased.json"));
  EXPECT_THAT(Names(recordings_->Erase({.person = "ann"}, {}, {}), "deleted"), IsEmpty());
}

TEST_F(RecordingsTest, NobodyIsErasedWhileBeingRecorded) {
  OpenAll();
  Record("a", "ann");
  Begin("now", "ann");
  for (const bool dry_run : {true, false}) {
    const auto report = recordings_->Erase({.person = "ann", .dry_run = dry_run}, {}, {});
    ASSERT_FALSE(report.ok());
    EXPECT_EQ(report.error().code, ErrorCode::kFailedPrecondition);
    EXPECT_EQ(report.error().message.find("ann"), std::string::npos);
  }
  EXPECT_TRUE(std::filesystem::exists(PathOf("a")));
  // Somebody else is.
  EXPECT_TRUE(recordings_->Erase({.person = "ben"}, {}, {}).ok());
  MustStop();
}

TEST_F(RecordingsTest, ABackupHoldsAllButWhatIsBeingWritten) {
  OpenAll();
  Record("a", "ann");
  Begin("now", "");
  const KeptParts kept = BackUp();
  MustStop();
  ASSERT_EQ(kept.plan.notices.size(), 1u);
  EXPECT_THAT(kept.plan.notices[0], HasSubstr("now.mcap"));
  EXPECT_EQ(kept.parts.size(), kept.plan.parts);
  ASSERT_EQ(kept.parts.size(), 2u);
  EXPECT_EQ(kept.parts[1].first, "recordings/a.mcap");
  const recording::Bytes bytes = Slurp(PathOf("a"));
  EXPECT_EQ(kept.parts[1].second, std::string(bytes.begin(), bytes.end()));

  EXPECT_EQ(Restore(kept, api::RestoreMode::kEmptyOnly).error().field, "header.mode");
  EXPECT_THAT(Names(Restore(kept, api::RestoreMode::kMerge), "kept"), ElementsAre("a.mcap"));
  EXPECT_THAT(Names(Restore(kept, api::RestoreMode::kReplace), "restored"), ElementsAre("a.mcap"));
  EXPECT_THAT(Files(), ElementsAre("a.mcap", "erased.json"));
  EXPECT_EQ(Slurp(PathOf("a")), bytes);
}

TEST_F(RecordingsTest, RestoringLeavesOutWhoWasErased) {
  OpenAll();
  Record("a", "ann");
  Record("b", "ben");
  const KeptParts kept = BackUp();
  ASSERT_TRUE(recordings_->Erase({.person = "ann"}, {}, {}).ok());
  const auto report = Restore(kept, api::RestoreMode::kReplace);
  EXPECT_THAT(Names(report, "left out"), ElementsAre("a.mcap"));
  EXPECT_THAT(Names(report, "restored"), ElementsAre("b.mcap"));
}

TEST_F(RecordingsTest, RestoringTakesNoNamesThatLeadElsewhere) {
  OpenAll();
  Record("a", "ann");
  const KeptParts kept = BackUp();
  for (const std::string name : {"recordings/../a.mcap", "recordings//a.mcap", "/etc/a.mcap",
                                 "recordings/.a.mcap", "recordings/a.txt", "a.mcap"}) {
    KeptParts other = kept;
    other.parts[1].first = name;
    EXPECT_EQ(Restore(other, api::RestoreMode::kMerge).error().code, ErrorCode::kInvalidArgument)
        << name;
  }
  EXPECT_THAT(Files(), ElementsAre("a.mcap"));
}

TEST_F(RecordingsTest, WhatIsOldGoes) {
  OpenAll();
  Record("a", "ann");
  Begin("now", "ann");
  EXPECT_THAT(Names(recordings_->ApplyRetention({}), "deleted"), IsEmpty());
  EXPECT_THAT(Names(recordings_->ApplyRetention(Keeping(5, true)), "deleted"),
              ElementsAre("a.mcap"));
  EXPECT_TRUE(std::filesystem::exists(PathOf("a")));
  EXPECT_THAT(Names(recordings_->ApplyRetention(Keeping(5)), "deleted"), ElementsAre("a.mcap"));
  MustStop();
  EXPECT_THAT(Files(), ElementsAre("now.mcap"));
}

TEST_F(RecordingsTest, APersonsIdIsCheckedAtTheStart) {
  OpenAll();
  api::RecordStart start;
  start.metadata["person"] = "a\nb";
  EXPECT_EQ(recorder_->Start(start).error().field, "metadata.person");
  EXPECT_THAT(Files(), IsEmpty());
}

}  // namespace
}  // namespace exemplar::recorder
