#include "learning/skills.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "exemplar/base/text.hpp"
#include "exemplar/learning/inspection.hpp"
#include "learning/behind_others.hpp"
#include "learning/skill_claim.hpp"

namespace exemplar::learning_service {
namespace {

/// How the time of learning is shared out.
constexpr double kLoaded = 0.1;
constexpr double kLearned = 0.95;

std::string Place(const std::string& name, int version) {
  return "skill \"" + name + "\" version " + std::to_string(version);
}

/// Older versions of skills that are kept in memory, of all skills together.
constexpr std::size_t kOlderVersions = 16;

std::vector<std::string> TrialIds(const learning::SkillReport& report) {
  std::vector<std::string> ids;
  for (const auto& trial : report.trials) ids.push_back(trial.id);
  return ids;
}

}  // namespace

Skills::Skills(Store& store, Trials& trials, const Clock& clock,
               std::shared_ptr<const demonstration::ToolKinematics> tool, Log& log)
    : store_(store),
      trials_(trials),
      clock_(clock),
      tool_(std::move(tool)),
      log_(log),
      older_(kOlderVersions) {
  Reload();
}

void Skills::Reload() {
  const Result<std::vector<api::SkillInfo>> all = store_.ListSkills();
  if (!all) {
    log_.Error("skills cannot be listed", {{"error", all.error().message}});
    return;
  }
  {
    const std::unique_lock lock(current_mutex_);
    for (const auto& [name, skill] : current_) older_.Forget(name);
    current_.clear();
  }
  for (const api::SkillInfo& info : *all) {
    Result<learning::Skill> skill = FromStore(info.name, info.version);
    if (skill) {
      SetCurrent(info.name, *std::move(skill));
    } else {
      log_.Error("skill cannot be loaded",
                 {{"skill", info.name}, {"error", skill.error().message}});
    }
  }
}

void Skills::SetCurrent(const std::string& name, learning::Skill skill) {
  const std::unique_lock lock(current_mutex_);
  current_.insert_or_assign(name, std::move(skill));
}

Result<learning::Skill> Skills::FromStore(const std::string& name, int version) {
  const Result<std::optional<std::string>> document = store_.Document(name, version);
  if (!document) return document.error();
  if (!*document) return NotFound("there is no " + Place(name, version), "version");
  Result<learning::Skill> skill = learning::SkillFromBytes(**document, tool_);
  if (!skill) return WithPlace(skill.error(), Place(name, version));
  return skill;
}

Result<learning::Skill> Skills::Find(const std::string& name, int version) {
  {
    const std::shared_lock lock(current_mutex_);
    const auto found = current_.find(name);
    if (found != current_.end() && (version == 0 || found->second.report().version == version)) {
      return found->second;
    }
  }
  if (std::optional<learning::Skill> kept = older_.Find(name, version)) return *std::move(kept);
  const std::uint64_t epoch = older_.epoch();
  const Result<std::vector<api::VersionInfo>> versions = store_.ListVersions(name);
  if (!versions) return versions.error();
  if (versions->empty()) return NoSuchSkill(name);
  for (const api::VersionInfo& info : *versions) {
    if (info.version == version || (version == 0 && info.current)) {
      Result<learning::Skill> skill = FromStore(name, info.version);
      if (skill) older_.Insert(name, *skill, epoch);
      return skill;
    }
  }
  return NotFound("skill \"" + name + "\" has no version " + std::to_string(version) +
                      "; its last is " + std::to_string(versions->back().version),
                  "version");
}

Error Skills::NoSuchSkill(const std::string& name) {
  std::string message = "there is no skill \"" + name + "\"";
  std::vector<std::string> names;
  if (const Result<std::vector<api::SkillInfo>> all = store_.ListSkills(); all) {
    for (const api::SkillInfo& info : *all) names.push_back(info.name);
  }
  if (const auto nearest = NearestName(name, names)) {
    message += "; did you mean \"" + *nearest + "\"?";
  }
  return NotFound(std::move(message), "name");
}

Result<std::vector<learning::NamedTrial>> Skills::LoadTrials(const std::string& skill,
                                                             const learning::LearnOptions& options,
                                                             const learning::Progress& progress,
                                                             const std::stop_token& stop) {
  const Result<std::vector<api::TrialInfo>> infos = trials_.List(skill);
  if (!infos) return infos.error();
  if (infos->empty()) {
    return NotFound("skill \"" + skill + "\" has no trials to learn from", "name");
  }
  for (const std::string& left_out : options.leave_out) {
    const bool known = std::any_of(infos->begin(), infos->end(), [&](const auto& info) {
      return info.id == left_out || info.source == left_out;
    });
    if (!known) {
      std::string message = "option leave_out: skill \"" + skill;
      message += "\" has no trial \"" + left_out + "\"";
      return InvalidArgument(std::move(message), "options.leave_out");
    }
  }
  std::vector<learning::NamedTrial> trials;
  for (std::size_t i = 0; i < infos->size(); ++i) {
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "learning was cancelled"};
    const double fraction = static_cast<double>(i) / static_cast<double>(infos->size());
    if (progress) progress(kLoaded * fraction, "reading the trials");
    Result<demonstration::Trial> trial = trials_.Load((*infos)[i].id);
    if (!trial) return WithPlace(trial.error(), "trial " + (*infos)[i].id);
    trials.push_back({(*infos)[i].id, *std::move(trial)});
  }
  return trials;
}

Result<learning::SkillReport> Skills::Learn(const std::string& name,
                                            const std::map<std::string, std::string>& options,
                                            const learning::Progress& progress,
                                            std::stop_token stop) {
  if (const Status valid = CheckSkillName(name, "name"); !valid) return valid.error();
  const Result<learning::LearnOptions> read = learning::LearnOptions::FromStrings(options);
  if (!read) {
    Error error = read.error();
    error.field = "options." + error.field;
    return error;
  }
  const Result<Claim> claim = Claim::Take(*this, name);
  if (!claim) return claim.error();
  return RunBehindOthers([&] { return LearnClaimed(name, *read, progress, stop); });
}

Result<learning::SkillReport> Skills::LearnClaimed(const std::string& name,
                                                   const learning::LearnOptions& options,
                                                   const learning::Progress& progress,
                                                   const std::stop_token& stop) {
  const Result<std::vector<learning::NamedTrial>> trials =
      LoadTrials(name, options, progress, stop);
  if (!trials) return trials.error();
  const Result<Learned> learned = LearnFrom(name, *trials, options, progress, stop);
  if (!learned) return learned.error();
  // The last chance to turn back: from here on the version is there.
  if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "learning was cancelled"};
  if (const Status added = store_.AddVersion(learned->stored); !added) return added.error();
  SetCurrent(name, learned->skill);
  return learned->skill.report();
}

Result<Skills::Learned> Skills::LearnFrom(const std::string& name,
                                          const std::vector<learning::NamedTrial>& trials,
                                          const learning::LearnOptions& options,
                                          const learning::Progress& progress,
                                          const std::stop_token& stop) {
  const Result<learning::Skill> learned = learning::LearnSkill(
      trials, options, tool_,
      [&](double fraction, std::string_view step) {
        if (progress) progress(kLoaded + (kLearned - kLoaded) * fraction, step);
      },
      stop);
  if (!learned) return learned.error();

  if (progress) progress(kLearned, "storing the skill");
  const Result<int> version = store_.NextVersion(name);
  if (!version) return version.error();
  const learning::Skill skill = learned->Named(name, *version);
  const learning::SkillReport& report = skill.report();
  StoredVersion stored{.skill = name,
                       .info = {.version = *version,
                                .current = true,
                                .method = report.method,
                                .trial_ids = TrialIds(report),
                                .learned = clock_.Now()},
                       .target = report.target,
                       .options = report.options,
                       .document = learning::ToBytes(skill)};
  return Learned{skill, std::move(stored)};
}

Result<std::vector<api::SkillInfo>> Skills::List() { return store_.ListSkills(); }

Result<learning::SkillReport> Skills::Show(const std::string& name, int version) {
  const Result<learning::Skill> skill = Find(name, version);
  if (!skill) return skill.error();
  return skill->report();
}

Result<std::vector<api::VersionInfo>> Skills::Versions(const std::string& name) {
  Result<std::vector<api::VersionInfo>> versions = store_.ListVersions(name);
  if (versions && versions->empty()) return NoSuchSkill(name);
  return versions;
}

Status Skills::Rollback(const std::string& name, int version) {
  if (version < 1) {
    return InvalidArgument("version is " + std::to_string(version) + ", must be at least 1",
                           "version");
  }
  const Result<Claim> claim = Claim::Take(*this, name);
  if (!claim) return claim.error();
  Result<learning::Skill> skill = Find(name, version);
  if (!skill) return skill.error();
  if (Status stored = store_.SetCurrent(name, version); !stored) return stored;
  SetCurrent(name, *std::move(skill));
  return {};
}

Status Skills::Delete(const std::string& name) {
  const Result<Claim> claim = Claim::Take(*this, name);
  if (!claim) return claim.error();
  const Result<bool> deleted = store_.DeleteSkill(name);
  if (!deleted) return deleted.error();
  if (!*deleted) return NoSuchSkill(name);
  older_.Forget(name);
  const std::unique_lock lock(current_mutex_);
  current_.erase(name);
  return {};
}

Result<demonstration::SkillMotion> Skills::Query(const std::string& name, int version,
                                                 const demonstration::SkillQuery& query) {
  const Result<learning::Skill> skill = Find(name, version);
  if (!skill) return skill.error();
  return learning::Answer(*skill, query);
}

Result<learning::Evaluation> Skills::Evaluate(const std::string& name, int version,
                                              const std::string& file_name, std::string file) {
  const Result<learning::Skill> skill = Find(name, version);
  if (!skill) return skill.error();
  const Result<demonstration::Trial> trial = trials_.Read(file_name, file);
  if (!trial) return trial.error();
  return learning::Evaluate(*skill, *trial);
}

Result<learning::Suggestions> Skills::Suggest(const std::string& name, int version,
                                              const learning::SuggestOptions& options) {
  const Result<learning::Skill> skill = Find(name, version);
  if (!skill) return skill.error();
  return learning::Suggest(*skill, options);
}

Result<std::string> Skills::ExportJson(const std::string& name, int version) {
  const Result<learning::Skill> skill = Find(name, version);
  if (!skill) return skill.error();
  nlohmann::json document = learning::ToJson(*skill);
  document["inspection"] = learning::ToJson(learning::Inspect(*skill));
  return document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace exemplar::learning_service
