#pragma once
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <shared_mutex>
#include <string>
#include <unordered_map>

#include "exemplar/api/services.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "learning/skill_cache.hpp"
#include "learning/store.hpp"
#include "learning/trials.hpp"

namespace exemplar::learning_service {

/// The skills. Current versions, and the older ones that were asked for last, are kept in memory as
/// immutable values that are exchanged whole, so that a query waits for nobody. Learning runs on
/// threads of its own that give way to all others. Thread-safe.
class Skills final : public api::SkillApi {
 public:
  /// Loads the current version of every stored skill; one that is damaged is logged, and its
  /// queries say so. All arguments but `tool` must outlive this; `tool` may be null.
  Skills(Store& store, Trials& trials, const Clock& clock,
         std::shared_ptr<const demonstration::ToolKinematics> tool, Log& log);

  /// One at a time for a skill: a second one is refused with kFailedPrecondition.
  Result<learning::SkillReport> Learn(const std::string& name,
                                      const std::map<std::string, std::string>& options,
                                      const learning::Progress& progress,
                                      std::stop_token stop) override;
  Result<std::vector<api::SkillInfo>> List() override;
  Result<learning::SkillReport> Show(const std::string& name, int version) override;
  Result<std::vector<api::VersionInfo>> Versions(const std::string& name) override;
  Status Rollback(const std::string& name, int version) override;
  /// Refused while the skill is being learned.
  Status Delete(const std::string& name) override;
  Result<demonstration::SkillMotion> Query(const std::string& name, int version,
                                           const demonstration::SkillQuery& query) override;
  Result<learning::Evaluation> Evaluate(const std::string& name, int version,
                                        const std::string& file_name, std::string file) override;
  Result<learning::Suggestions> Suggest(const std::string& name, int version,
                                        const learning::SuggestOptions& options) override;
  Result<std::string> ExportJson(const std::string& name, int version) override;

  /// Takes out the versions `removed` of one skill; the current one is learned anew from the trials
  /// of it that are stored and not among `gone`, where that succeeds. Says what was done.
  Result<std::vector<api::DataItem>> TakeOut(const std::string& name,
                                             const std::vector<StoredVersion>& removed,
                                             const TrialNames& gone,
                                             const learning::Progress& progress,
                                             const std::stop_token& stop);
  /// Learns a version again that the store has lost; its trials are those that are stored.
  Result<api::DataItem> Relearn(const Relearning& lost, const learning::Progress& progress,
                                const std::stop_token& stop);
  /// Does `work` while no skill can be learned or changed; refused where one is being.
  Status WhileNobodyLearns(const std::function<Status()>& work);
  /// Reads all anew: the store was changed from outside.
  void Reload();

 private:
  class Claim;  ///< of the right to change one skill

  /// Precondition: the claim of `name` is held.
  Result<learning::SkillReport> LearnClaimed(const std::string& name,
                                             const learning::LearnOptions& options,
                                             const learning::Progress& progress,
                                             const std::stop_token& stop);
  /// A skill that is learned but not stored.
  struct Learned {
    learning::Skill skill;
    StoredVersion stored;
  };
  Result<Learned> LearnFrom(const std::string& name,
                            const std::vector<learning::NamedTrial>& trials,
                            const learning::LearnOptions& options,
                            const learning::Progress& progress, const std::stop_token& stop);
  /// Of the trials that are named, those that are stored and not among `gone`.
  Result<Learned> LearnAgain(const Relearning& what, const TrialNames& gone,
                             const learning::Progress& progress, const std::stop_token& stop);
  Result<std::vector<learning::NamedTrial>> LoadTrials(const std::string& skill,
                                                       const learning::LearnOptions& options,
                                                       const learning::Progress& progress,
                                                       const std::stop_token& stop);
  /// From memory, else from the store.
  Result<learning::Skill> Find(const std::string& name, int version);
  Result<learning::Skill> FromStore(const std::string& name, int version);
  Error NoSuchSkill(const std::string& name);
  void SetCurrent(const std::string& name, learning::Skill skill);

  Store& store_;
  Trials& trials_;
  const Clock& clock_;
  const std::shared_ptr<const demonstration::ToolKinematics> tool_;
  Log& log_;

  std::mutex claims_mutex_;
  std::set<std::string> claims_;  ///< names of skills that are being changed; "": all

  std::shared_mutex current_mutex_;  ///< held for a look-up or an exchange only
  std::unordered_map<std::string, learning::Skill> current_;
  SkillCache older_;
};

}  // namespace exemplar::learning_service
