// What operators do with skills: versions are taken out, and learned anew.

#include <algorithm>

#include "learning/behind_others.hpp"
#include "learning/skill_claim.hpp"
#include "learning/skills.hpp"

namespace exemplar::learning_service {
namespace {

std::string VersionName(const std::string& skill, int version) {
  return skill + " " + std::to_string(version);
}

}  // namespace

Status Skills::WhileNobodyLearns(const std::function<Status()>& work) {
  const Result<Claim> claim = Claim::TakeAll(*this);
  if (!claim) return claim.error();
  return work();
}

Result<Skills::Learned> Skills::LearnAgain(const Relearning& what, const TrialNames& gone,
                                           const learning::Progress& progress,
                                           const std::stop_token& stop) {
  const Result<std::vector<api::TrialInfo>> infos = trials_.List(what.skill);
  if (!infos) return infos.error();
  std::vector<learning::NamedTrial> trials;
  for (const api::TrialInfo& info : *infos) {
    const bool named =
        std::find(what.trial_ids.begin(), what.trial_ids.end(), info.id) != what.trial_ids.end();
    if (!named || gone.ids.contains(info.id)) continue;
    Result<demonstration::Trial> trial = trials_.Load(info.id);
    if (!trial) return WithPlace(trial.error(), "trial " + info.id);
    trials.push_back({info.id, *std::move(trial)});
  }
  if (trials.empty()) return FailedPrecondition("no trial is left to learn from");
  // What it left out is no trial of it, and may be gone.
  std::map<std::string, std::string> options = what.options;
  options.erase("leave_out");
  const Result<learning::LearnOptions> read = learning::LearnOptions::FromStrings(options);
  if (!read) return read.error();
  return RunBehindOthers([&] { return LearnFrom(what.skill, trials, *read, progress, stop); });
}

Result<std::vector<api::DataItem>> Skills::TakeOut(const std::string& name,
                                                   const std::vector<StoredVersion>& removed,
                                                   const TrialNames& gone,
                                                   const learning::Progress& progress,
                                                   const std::stop_token& stop) {
  const Result<Claim> claim = Claim::Take(*this, name);
  if (!claim) return claim.error();
  std::vector<api::DataItem> done;
  std::vector<int> numbers;
  std::optional<Learned> learned;
  for (const StoredVersion& version : removed) {
    numbers.push_back(version.info.version);
    done.push_back({.kind = "skill version",
                    .name = VersionName(name, version.info.version),
                    .action = "deleted",
                    .at = version.info.learned});
    if (!version.info.current) continue;
    Result<Learned> again =
        LearnAgain({name, version.options, version.info.trial_ids}, gone, progress, stop);
    if (!again && again.error().code == ErrorCode::kCancelled) return again.error();
    if (again) {
      learned = *std::move(again);
    } else {
      done.back().detail = "it cannot be learned anew: " + again.error().message;
    }
  }
  if (Status replaced = store_.ReplaceVersions(
          name, numbers, learned ? std::optional(learned->stored) : std::nullopt);
      !replaced) {
    return replaced.error();
  }
  older_.Forget(name);
  if (learned) {
    SetCurrent(name, learned->skill);
    done.push_back(
        {.kind = "skill version",
         .name = VersionName(name, learned->stored.info.version),
         .action = "relearned",
         .detail = "from " + std::to_string(learned->stored.info.trial_ids.size()) + " trials",
         .at = learned->stored.info.learned});
    return done;
  }
  const Result<std::vector<api::VersionInfo>> left = store_.ListVersions(name);
  if (!left) return left.error();
  {
    const std::unique_lock lock(current_mutex_);
    current_.erase(name);
  }
  if (left->empty()) {
    done.push_back(
        {.kind = "skill", .name = name, .action = "deleted", .detail = "no version is left"});
    return done;
  }
  for (const api::VersionInfo& version : *left) {
    if (!version.current) continue;
    Result<learning::Skill> skill = FromStore(name, version.version);
    if (skill) SetCurrent(name, *std::move(skill));
  }
  return done;
}

Result<api::DataItem> Skills::Relearn(const Relearning& lost, const learning::Progress& progress,
                                      const std::stop_token& stop) {
  const Result<Claim> claim = Claim::Take(*this, lost.skill);
  if (!claim) return claim.error();
  const Result<Learned> learned = LearnAgain(lost, {}, progress, stop);
  if (!learned) {
    return api::DataItem{.kind = "skill",
                         .name = lost.skill,
                         .action = "left out",
                         .detail = "it cannot be learned anew: " + learned.error().message};
  }
  if (const Status added = store_.AddVersion(learned->stored); !added) return added.error();
  SetCurrent(lost.skill, learned->skill);
  return api::DataItem{
      .kind = "skill version",
      .name = VersionName(lost.skill, learned->stored.info.version),
      .action = "relearned",
      .detail = "from " + std::to_string(learned->stored.info.trial_ids.size()) + " trials",
      .at = learned->stored.info.learned};
}

}  // namespace exemplar::learning_service
