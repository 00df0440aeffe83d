#pragma once
// What the learning service keeps: trial files and skill versions, in one SQLite file.

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/api/data.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/base/result.hpp"
#include "learning/database.hpp"

namespace exemplar::learning_service {

/// A skill version as stored. `document` is what learning::ToBytes made of the skill.
struct StoredVersion {
  std::string skill;
  api::VersionInfo info;
  std::string target;
  std::map<std::string, std::string> options;
  std::string document;
};

/// Trials as skill versions name them.
struct TrialNames {
  std::set<std::string> ids;
  std::set<std::pair<std::string, std::string>> sources;  ///< with their skill before them
};
/// Whether the version was learned from one of the trials, or names one that it left out.
bool Mentions(const StoredVersion& version, const TrialNames& trials);

/// A version that is to be learned anew from some of its trials.
struct Relearning {
  std::string skill;
  std::map<std::string, std::string> options;
  std::vector<std::string> trial_ids;
};

struct RestoreOutcome {
  api::DataReport report;
  std::vector<Relearning> relearn;  ///< current versions that were left out
};

/// Durable when a method returns; all or nothing. Thread-safe: one call at a time.
class Store {
 public:
  /// Opens or makes `folder`/learning.db, brought up to the present schema. kFailedPrecondition
  /// when another process has it open or a newer program wrote it; kDataLoss when it is damaged.
  static Result<std::unique_ptr<Store>> Open(const std::filesystem::path& folder);
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  /// Precondition: no trial of that id is stored.
  Status AddTrial(const api::TrialInfo& info, std::string_view file);
  Result<std::optional<api::TrialInfo>> FindTrial(const std::string& id);
  /// In the order of submission; `skill` empty: of all skills; `person` empty: of everybody.
  Result<std::vector<api::TrialInfo>> ListTrials(const std::string& skill,
                                                 const std::string& person);
  /// The file as submitted.
  Result<std::string> TrialFile(const std::string& id);
  /// False: there was none.
  Result<bool> DeleteTrial(const std::string& id);
  /// Empty: unknown. False: there is no such trial, and no skill version was learned from one.
  Result<bool> SetPerson(const std::string& id, const std::string& person);

  /// The number that AddVersion would take: never one that was used before, be it of a skill of
  /// that name that was deleted.
  Result<int> NextVersion(const std::string& skill);
  /// Adds it as the current version.
  Status AddVersion(const StoredVersion& version);
  /// By name.
  Result<std::vector<api::SkillInfo>> ListSkills();
  /// Without documents; oldest first; empty when there is no such skill.
  Result<std::vector<api::VersionInfo>> ListVersions(const std::string& skill);
  Result<std::optional<std::string>> Document(const std::string& skill, int version);
  /// Precondition: the version exists.
  Status SetCurrent(const std::string& skill, int version);
  /// False: there was none.
  Result<bool> DeleteSkill(const std::string& skill);

  // What operators do with all of it: store_data.cpp.

  Result<std::vector<api::PersonInfo>> ListPersons();
  /// Those that are stored, and those that are gone but stand in a skill version.
  Result<std::vector<std::string>> TrialIdsOf(const std::string& person);
  /// Of all skills, oldest first, without documents.
  Result<std::vector<StoredVersion>> AllVersions();
  /// Of their files as stored, by id.
  Result<std::map<std::string, std::uint64_t>> TrialBytes();
  /// In one step: adds `added` as the current version, takes out `removed`; without `added`, the
  /// newest that is left becomes the current one where the current one is taken out. The skill goes
  /// with its last version.
  Status ReplaceVersions(const std::string& skill, const std::vector<int>& removed,
                         const std::optional<StoredVersion>& added);
  Status DeleteTrials(const std::vector<std::string>& ids);
  /// Takes the trials out and notes that their person was erased; whose they were stays known until
  /// FinishErasure.
  Status BeginErasure(const std::vector<std::string>& trials, const api::ErasedPerson& person);
  /// Forgets whose the trials were, and rewrites the file so that nothing of what was deleted is
  /// left in it.
  Status FinishErasure(const std::vector<std::string>& trials);
  /// An erasure was begun and not finished.
  Result<bool> HasUnfinishedErasure();
  Result<std::vector<api::ErasedPerson>> ErasedPersons();

  Result<bool> IsEmpty();
  /// A consistent copy of all that is stored when it begins, read on a connection of its own while
  /// this store goes on.
  Status BackUp(api::BackupSink& sink, const std::stop_token& stop);
  /// All or nothing. Persons who were erased before their trials came are left out, with every
  /// skill version that was learned from them.
  Result<RestoreOutcome> Restore(const api::RestoreRequest& request, api::BackupSource& source);

 private:
  struct LockFile;
  Store(std::filesystem::path folder, std::unique_ptr<LockFile> lock,
        std::unique_ptr<Database> database);

  /// Precondition: the lock is held, and a transaction is open.
  Status InsertVersion(const StoredVersion& version, const std::string& document);

  const std::filesystem::path folder_;

  std::unique_ptr<LockFile> lock_;
  std::mutex mutex_;
  std::unique_ptr<Database> database_;
};

}  // namespace exemplar::learning_service
