#pragma once
#include <mutex>
#include <string>
#include <thread>

#include "exemplar/api/data.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "learning/skills.hpp"
#include "learning/store.hpp"

namespace exemplar::learning_service {

/// What goes by itself once it is old; 0: never.
struct Retention {
  double keep_trials_days = 0;
  /// Of skill versions that are not the current ones.
  double keep_versions_days = 0;
  /// Trials that a current skill version was learned from go as well.
  bool needed_too = false;

  bool any() const { return keep_trials_days > 0 || keep_versions_days > 0; }
};

/// What operators do with trials and skills: persons, erasure, retention, backup. Where retention
/// is set, a thread of its own applies it at once and every hour. Thread-safe.
class Data final : public api::DataApi {
 public:
  /// All must outlive this.
  Data(Store& store, Skills& skills, const Clock& clock, Log& log, const Retention& retention);

  Result<std::vector<api::PersonInfo>> ListPersons() override;
  Result<api::DataReport> Erase(const api::EraseRequest& request, const api::DataProgress& progress,
                                std::stop_token stop) override;
  Result<api::DataReport> ApplyRetention(const api::RetentionRequest& request) override;
  Status Backup(api::BackupSink& sink, std::stop_token stop) override;
  Result<api::DataReport> Restore(const api::RestoreRequest& request,
                                  api::BackupSource& source) override;

 private:
  class Work;  ///< the right to do one of these things

  /// What an erasure is about.
  struct Scope {
    TrialNames names;
    std::vector<std::string> ids;
    std::vector<api::TrialInfo> stored;
    std::map<std::string, std::vector<StoredVersion>> versions;  ///< by skill
  };
  Result<Scope> ScopeOf(const std::string& person);
  Result<api::DataReport> Foretell(const Scope& scope);
  /// Takes the trials out and keeps the person's hash.
  Status NoteErased(const std::string& person, const std::vector<std::string>& trials);
  Result<api::DataReport> Carry(const Scope& scope, const std::string& person,
                                const api::DataProgress& progress, const std::stop_token& stop);
  /// Precondition: the right is held.
  Result<api::DataReport> ApplyRetentionHeld(const Retention& retention, bool dry_run);
  void Audit(const api::DataItem& item);

  Store& store_;
  Skills& skills_;
  const Clock& clock_;
  Log& log_;
  const Retention retention_;
  std::mutex mutex_;
  std::string under_way_;  ///< empty: nothing
  std::jthread thread_;    ///< the last member: it uses the others
};

}  // namespace exemplar::learning_service
