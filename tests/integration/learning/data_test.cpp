// Whose trials there are, erasure, retention and backups, as clients of the service see them.

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <thread>

#include "running_service.hpp"

namespace exemplar::learning_service {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// A backup in memory.
struct Kept final : api::BackupSink {
  api::BackupPlan plan;
  std::vector<std::pair<std::string, std::string>> parts;
  std::function<void()> at_first_part = [] {};

  Status Begin(const api::BackupPlan& announced) override {
    plan = announced;
    return {};
  }
  Status BeginPart(const api::BackupPart& part) override {
    if (parts.empty()) at_first_part();
    parts.emplace_back(part.name, "");
    return {};
  }
  Status Write(std::string_view bytes) override {
    parts.back().second += bytes;
    return {};
  }
};

/// ... which comes back; `broken_after` parts the connection goes.
class Returning final : public api::BackupSource {
 public:
  explicit Returning(const Kept& kept, std::size_t broken_after = 1'000'000)
      : kept_(kept), broken_after_(broken_after) {}
  Result<std::optional<api::BackupPart>> NextPart() override {
    if (next_ == broken_after_) return Error{ErrorCode::kDataLoss, "broken on purpose"};
    if (next_ == kept_.parts.size()) return std::optional<api::BackupPart>();
    const auto& [name, bytes] = kept_.parts[next_++];
    left_ = bytes;
    return std::optional(api::BackupPart{name, bytes.size()});
  }
  Result<std::string> Read() override { return std::exchange(left_, {}); }

 private:
  const Kept& kept_;
  const std::size_t broken_after_;
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

class DataTest : public LearningServiceTest {
 protected:
  api::DataApi& data() { return *service_->client.learning_data; }

  /// The first three are ann's, the others ben's.
  void SubmitPersonsTrials() {
    SubmitAll();
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      ASSERT_TRUE(trials().SetPerson(ids_[i], i < 3 ? "ann" : "ben").ok());
    }
  }
  std::vector<std::string> Persons() {
    std::vector<std::string> names;
    const auto persons = data().ListPersons();
    EXPECT_TRUE(persons.ok());
    for (const api::PersonInfo& info : *persons) names.push_back(info.person);
    return names;
  }
  Kept BackUp() {
    Kept kept;
    const Status done = data().Backup(kept, {});
    EXPECT_TRUE(done.ok()) << done.error().message;
    return kept;
  }
  Result<api::DataReport> Restore(const Kept& kept, api::RestoreMode mode) {
    Returning source(kept);
    return data().Restore({.plan = kept.plan, .mode = mode, .erased = {}}, source);
  }
  void StartAnew(const std::string& folder) {
    service_.reset();
    service_ = std::make_unique<Service>(folder_ / folder);
  }
  std::string StoredBytes() const {
    std::string all;
    for (const auto& file : std::filesystem::directory_iterator(folder_)) {
      if (!file.is_regular_file()) continue;
      std::ifstream stream(file.path(), std::ios::binary);
      all.append(std::istreambuf_iterator<char>(stream), {});
    }
    return all;
  }
};

TEST_F(DataTest, TrialsKnowTheirPerson) {
  const auto submitted = trials().Submit("press", "a.csv", PressTrial(kPlaces[0], 0), "ann");
  ASSERT_TRUE(submitted.ok()) << submitted.error().message;
  EXPECT_EQ(submitted->info.person, "ann");
  const std::string id = submitted->info.id;
  ASSERT_TRUE(trials().Submit("press", "b.csv", PressTrial(kPlaces[1], 1)).ok());
  EXPECT_EQ(trials().List("", "ann")->size(), 1u);
  EXPECT_EQ(trials().List("", "ben")->size(), 0u);
  EXPECT_EQ(trials().List("")->size(), 2u);
  EXPECT_THAT(Persons(), ElementsAre("", "ann"));
  ASSERT_TRUE(trials().SetPerson(id, "ben").ok());
  EXPECT_EQ(trials().Get(id)->person, "ben");
  ASSERT_TRUE(trials().SetPerson(id, "").ok());
  EXPECT_EQ(trials().Get(id)->person, "");
  EXPECT_EQ(trials().SetPerson("trial-0", "ann").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(trials().SetPerson(id, "a\nb").error().field, "person");
  EXPECT_EQ(trials()
                .Submit("press", "c.csv", PressTrial(kPlaces[2], 2), std::string(101, 'x'))
                .error()
                .field,
            "person");
}

TEST_F(DataTest, ATrialThatComesTwiceIsOnePersons) {
  const std::string file = PressTrial(kPlaces[0], 0);
  ASSERT_TRUE(trials().Submit("press", "a.csv", file).ok());
  const auto named = trials().Submit("press", "a.csv", file, "ann");
  ASSERT_TRUE(named.ok());
  EXPECT_TRUE(named->duplicate);
  EXPECT_EQ(named->info.person, "ann");
  EXPECT_EQ(trials().Get(named->info.id)->person, "ann");
  EXPECT_TRUE(trials().Submit("press", "a.csv", file).ok());
  EXPECT_EQ(trials().Submit("press", "a.csv", file, "ben").error().field, "person");
}

TEST_F(DataTest, ErasureFindsVersionsOfTrialsThatAreGone) {
  SubmitPersonsTrials();
  ASSERT_TRUE(skills().Learn("press", {{"method", "paper"}}, {}, {}).ok());
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(trials().Delete(ids_[i]).ok());
  EXPECT_THAT(Persons(), ElementsAre("ann", "ben"));
  const auto report = data().Erase({.person = "ann"}, {}, {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(Persons(), ElementsAre("ben"));
  const auto versions = skills().Versions("press");
  ASSERT_TRUE(versions.ok());
  ASSERT_EQ(versions->size(), 1u);
  EXPECT_EQ(versions->at(0).version, 2);
  EXPECT_EQ(versions->at(0).trial_ids.size(), 3u);
  EXPECT_EQ(skills().Show("press", 0)->options.at("method"), "paper");
  EXPECT_EQ(skills().Show("press", 1).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(skills().Query("press", 0, At({0.5, 0}))->version, 2);
}

TEST_F(DataTest, AVersionWithoutThePersonComesBackWhereTheCurrentOneCannotBeLearnedAnew) {
  SubmitPersonsTrials();
  ASSERT_TRUE(skills().Learn("press", {}, {}, {}).ok());
  for (std::size_t i = 3; i < ids_.size(); ++i) ASSERT_TRUE(trials().Delete(ids_[i]).ok());
  ASSERT_TRUE(skills().Learn("press", {}, {}, {}).ok());  // ann's alone
  ASSERT_TRUE(skills().Rollback("press", 1).ok());
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(trials().Delete(ids_[i]).ok());
  ASSERT_TRUE(data().Erase({.person = "ben"}, {}, {}).ok());
  const auto versions = skills().Versions("press");
  ASSERT_TRUE(versions.ok());
  ASSERT_EQ(versions->size(), 1u);
  EXPECT_EQ(versions->at(0).version, 2);
  EXPECT_TRUE(versions->at(0).current);
  EXPECT_EQ(skills().Query("press", 0, At({0.5, 0}))->version, 2);
}

TEST_F(DataTest, LeavesNothingOfThePersonInTheFiles) {
  SubmitPersonsTrials();
  ASSERT_TRUE(trials().SetPerson(ids_[0], "somebody-by-a-long-name").ok());
  ASSERT_TRUE(skills().Learn("press", {}, {}, {}).ok());
  ASSERT_THAT(StoredBytes(), HasSubstr("somebody-by-a-long-name"));
  ASSERT_TRUE(data().Erase({.person = "somebody-by-a-long-name"}, {}, {}).ok());
  EXPECT_EQ(StoredBytes().find("somebody-by-a-long-name"), std::string::npos);
  EXPECT_EQ(StoredBytes().find(ids_[0]), std::string::npos);
}

TEST_F(DataTest, ADryRunChangesNothingAndSaysTheSame) {
  SubmitPersonsTrials();
  ASSERT_TRUE(skills().Learn("press", {}, {}, {}).ok());
  const auto foreseen = data().Erase({.person = "ann", .dry_run = true}, {}, {});
  ASSERT_TRUE(foreseen.ok());
  EXPECT_EQ(trials().List("", "ann")->size(), 3u);
  EXPECT_EQ(skills().Versions("press")->size(), 1u);
  const auto done = data().Erase({.person = "ann"}, {}, {});
  ASSERT_TRUE(done.ok());
  for (const api::DataItem& item : foreseen->items) {
    const bool said = std::any_of(done->items.begin(), done->items.end(), [&](const auto& other) {
      return other.kind == item.kind && other.name == item.name && other.action == item.action;
    });
    EXPECT_TRUE(said) << item.kind << " " << item.name;
  }
}

TEST_F(DataTest, AnErasureDuringLearningIsFinishedByTheNext) {
  SubmitPersonsTrials();
  ASSERT_TRUE(skills().Learn("press", {}, {}, {}).ok());
  std::optional<Error> refused;
  const auto report = service_->skills->Learn("press", {},
                                              [&](double fraction, std::string_view) {
                                                if (refused || fraction < 0.2) return;
                                                refused =
                                                    data().Erase({.person = "ann"}, {}, {}).error();
                                              },
                                              {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, ErrorCode::kFailedPrecondition);
  EXPECT_THAT(refused->message, HasSubstr("run it again"));
  EXPECT_EQ(trials().List("", "ann")->size(), 0u);
  // What was being learned holds ann's trials: it is found as well.
  ASSERT_TRUE(data().Erase({.person = "ann"}, {}, {}).ok());
  const auto versions = skills().Versions("press");
  ASSERT_TRUE(versions.ok());
  for (const api::VersionInfo& version : *versions) {
    EXPECT_EQ(version.trial_ids.size(), 3u);
  }
  EXPECT_THAT(Persons(), ElementsAre("ben"));
}

TEST_F(DataTest, OneOfTheseThingsIsDoneAtATime) {
  SubmitPersonsTrials();
  std::optional<Error> erasure;
  std::optional<Error> backup;
  Kept kept;
  kept.at_first_part = [&] {
    erasure = data().Erase({.person = "ann"}, {}, {}).error();
    Kept other;
    backup = data().Backup(other, {}).error();
    // The rest of the service goes on.
    EXPECT_TRUE(trials().Submit("push", "a.csv", PressTrial(kPlaces[0], 9)).ok());
    EXPECT_TRUE(trials().Delete(ids_[5]).ok());
  };
  // Within the process: over the network the copy may be on its way before it is looked at.
  ASSERT_TRUE(service_->data->Backup(kept, {}).ok());
  ASSERT_TRUE(erasure && backup);
  EXPECT_THAT(erasure->message, HasSubstr("a backup is under way"));
  EXPECT_EQ(backup->code, ErrorCode::kFailedPrecondition);
  // It is of the moment in which it began.
  EXPECT_EQ(kept.plan.counts.at("trials"), 6u);
  EXPECT_EQ(kept.parts.size(), kept.plan.parts);
}

TEST_F(DataTest, ARestoredStoreAnswersTheSame) {
  SubmitPersonsTrials();
  ASSERT_TRUE(skills().Learn("press", {{"method", "paper"}}, {}, {}).ok());
  ASSERT_TRUE(skills().Learn("press", {}, {}, {}).ok());
  ASSERT_TRUE(skills().Rollback("press", 1).ok());
  const auto motion = skills().Query("press", 0, At({0.5, 0}));
  const auto csv = trials().ExportCsv(ids_[2]);
  const auto document = skills().ExportJson("press", 2);
  const Kept kept = BackUp();
  StartAnew("other");
  const auto report = Restore(kept, api::RestoreMode::kEmptyOnly);
  ASSERT_TRUE(report.ok()) << report.error().message;
  const auto again = skills().Query("press", 0, At({0.5, 0}));
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->version, 1);
  EXPECT_EQ(Path(*again), Path(*motion));
  EXPECT_EQ(*trials().ExportCsv(ids_[2]), *csv);
  EXPECT_EQ(*skills().ExportJson("press", 2), *document);
  EXPECT_EQ(trials().Get(ids_[2])->person, "ann");
  EXPECT_EQ(skills().Learn("press", {}, {}, {})->version, 3);
  EXPECT_EQ(Restore(kept, api::RestoreMode::kEmptyOnly).error().field, "header.mode");
}

TEST_F(DataTest, MergingAddsWhatIsNotThereAndLeavesTheRest) {
  SubmitPersonsTrials();
  ASSERT_TRUE(skills().Learn("press", {}, {}, {}).ok());
  const Kept kept = BackUp();
  StartAnew("other");
  SubmitAll("push");
  ASSERT_TRUE(skills().Learn("push", {}, {}, {}).ok());
  ASSERT_TRUE(trials().Submit("press", "mine.csv", PressTrial(kPlaces[0], 0)).ok());
  ASSERT_TRUE(Restore(kept, api::RestoreMode::kMerge).ok());
  EXPECT_EQ(trials().List("press")->size(), 6u);
  EXPECT_EQ(trials().List("press")->at(0).source, "mine.csv");
  EXPECT_EQ(trials().List("press")->at(0).person, "ann");
  EXPECT_EQ(skills().List()->size(), 2u);
  ASSERT_TRUE(Restore(kept, api::RestoreMode::kReplace).ok());
  EXPECT_EQ(skills().List()->size(), 1u);
  EXPECT_EQ(trials().List("push")->size(), 0u);
  EXPECT_EQ(skills().Query("push", 0, At({0.5, 0})).error().code, ErrorCode::kNotFound);
}

TEST_F(DataTest, ABrokenBackupChangesNothing) {
  SubmitPersonsTrials();
  ASSERT_TRUE(skills().Learn("press", {}, {}, {}).ok());
  const Kept whole = BackUp();
  StartAnew("other");
  SubmitAll("push");
  const auto refused = [&](const Kept& kept, std::size_t broken_after = 1'000'000) {
    Returning source(kept, broken_after);
    // Within the process: a client that breaks off does not wait for the service's end.
    const auto report = service_->data->Restore(
        {.plan = kept.plan, .mode = api::RestoreMode::kReplace, .erased = {}}, source);
    EXPECT_FALSE(report.ok());
    EXPECT_EQ(trials().List("push")->size(), 6u);
    EXPECT_EQ(trials().List("press")->size(), 0u);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "other" / "restoring.db"));
    return report.ok() ? std::string() : report.error().message;
  };
  for (std::size_t parts = 0; parts < whole.parts.size(); parts += 2) refused(whole, parts);
  Kept damaged = whole;
  damaged.parts.pop_back();
  EXPECT_THAT(refused(damaged), HasSubstr("is missing"));
  damaged = whole;
  damaged.parts[2].second[20] ^= 0x55;
  EXPECT_THAT(refused(damaged), HasSubstr("part trials/"));
  damaged = whole;
  damaged.parts.emplace_back("trials/strange.zst", "x");
  EXPECT_THAT(refused(damaged), HasSubstr("does not know the part"));
  for (const std::string rows : {"", "{", "[]", "{\"trials\": 3}", "{\"trials\": [{\"id\": 1}]}"}) {
    damaged = whole;
    damaged.parts[0].second = rows;
    EXPECT_THAT(refused(damaged), HasSubstr("store.json"));
  }
  damaged = whole;
  damaged.plan.schema = 99;
  EXPECT_THAT(refused(damaged), HasSubstr("newer program"));
  damaged.plan = whole.plan;
  damaged.plan.service = "recorder";
  EXPECT_THAT(refused(damaged), HasSubstr("recorder"));
}

TEST_F(DataTest, RestoringLeavesOutWhoWasErasedSince) {
  SubmitPersonsTrials();
  ASSERT_TRUE(skills().Learn("press", {}, {}, {}).ok());
  const Kept kept = BackUp();
  service_->clock.Advance(std::chrono::hours(1));
  ASSERT_TRUE(data().Erase({.person = "ann"}, {}, {}).ok());
  const auto report = Restore(kept, api::RestoreMode::kReplace);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(Persons(), ElementsAre("ben"));
  EXPECT_EQ(skills().Versions("press")->at(0).trial_ids.size(), 3u);
  EXPECT_EQ(skills().Query("press", 0, At({0.5, 0}))->version,
            skills().Versions("press")->at(0).version);
  // What ann gives afterwards stays.
  service_->clock.Advance(std::chrono::hours(1));
  ASSERT_TRUE(trials().Submit("press", "new.csv", PressTrial(kPlaces[0], 77), "ann").ok());
  const Kept later = BackUp();
  ASSERT_TRUE(Restore(later, api::RestoreMode::kReplace).ok());
  EXPECT_THAT(Persons(), ElementsAre("ann", "ben"));
}

TEST_F(DataTest, WhatIsOldGoesButForWhatACurrentVersionNeeds) {
  SubmitPersonsTrials();
  ASSERT_TRUE(skills().Learn("press", {{"leave_out", ids_[5]}}, {}, {}).ok());
  ASSERT_TRUE(skills().Learn("press", {{"leave_out", ids_[5]}}, {}, {}).ok());
  service_->clock.Advance(std::chrono::hours(24 * 10));
  SubmitAll("push");
  const api::RetentionRequest show{.dry_run = true, .keep_days = 5, .keep_versions_days = 5};
  EXPECT_THAT(data().ApplyRetention(Keeping({}, true))->items, testing::IsEmpty());
  const auto shown = data().ApplyRetention(show);
  ASSERT_TRUE(shown.ok()) << shown.error().message;
  ASSERT_EQ(shown->items.size(), 2u);
  EXPECT_EQ(shown->items[0].name, ids_[5]);
  EXPECT_EQ(shown->items[1].name, "press 1");
  EXPECT_EQ(trials().List("press")->size(), 6u);
  ASSERT_TRUE(data().ApplyRetention({.keep_days = 5, .keep_versions_days = 5}).ok());
  EXPECT_EQ(trials().List("press")->size(), 5u);
  EXPECT_EQ(skills().Versions("press")->size(), 1u);
  api::RetentionRequest all = Keeping(5);
  all.needed_too = true;
  ASSERT_TRUE(data().ApplyRetention(all).ok());
  EXPECT_EQ(trials().List("press")->size(), 0u);
  EXPECT_EQ(trials().List("push")->size(), 6u);
  EXPECT_TRUE(skills().Query("press", 0, At({0.5, 0})).ok());
  EXPECT_EQ(data().ApplyRetention(Keeping(-1)).error().field, "keep_days");
}

}  // namespace
}  // namespace exemplar::learning_service
