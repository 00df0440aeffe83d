#pragma once
// What the learning service keeps: trial files and skill versions, in one SQLite file.

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

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
  /// In the order of submission; `skill` empty: of all skills.
  Result<std::vector<api::TrialInfo>> ListTrials(const std::string& skill);
  /// The file as submitted.
  Result<std::string> TrialFile(const std::string& id);
  /// False: there was none.
  Result<bool> DeleteTrial(const std::string& id);

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

 private:
  struct LockFile;
  Store(std::unique_ptr<LockFile> lock, std::unique_ptr<Database> database);

  std::unique_ptr<LockFile> lock_;
  std::mutex mutex_;
  std::unique_ptr<Database> database_;
};

}  // namespace exemplar::learning_service
