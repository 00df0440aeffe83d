#include "learning/data.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "exemplar/security/digest.hpp"

namespace exemplar::learning_service {
namespace {

constexpr double kSecondsOfDay = 86'400;

/// A new mark for `person`, under the salt of those that are there.
api::ErasedPerson Mark(const std::vector<api::ErasedPerson>& there, const std::string& person,
                       Stamp now) {
  constexpr std::size_t kSaltBytes = 16;
  const std::string salt = there.empty() ? security::RandomText(kSaltBytes) : there.front().salt;
  return {.salt = salt, .hash = security::PersonHash(salt, person), .erased = now};
}

/// `bytes` of all trials: one that came meanwhile is not among them.
api::DataItem DeletedTrial(const api::TrialInfo& trial,
                           const std::map<std::string, std::uint64_t>& bytes) {
  const auto size = bytes.find(trial.id);
  return {.kind = "trial",
          .name = trial.id,
          .action = "deleted",
          .detail = "of skill " + trial.skill,
          .bytes = size == bytes.end() ? 0 : size->second,
          .at = trial.submitted};
}

}  // namespace

class Data::Work {
 public:
  static Result<Work> Begin(Data& data, const std::string& what) {
    const std::lock_guard lock(data.mutex_);
    if (!data.under_way_.empty()) {
      return FailedPrecondition(data.under_way_ + " is under way; try again when it is done");
    }
    data.under_way_ = what;
    return Work(data);
  }
  Work(Work&& other) noexcept : data_(std::exchange(other.data_, nullptr)) {}
  Work& operator=(Work&&) = delete;
  ~Work() {
    if (!data_) return;
    const std::lock_guard lock(data_->mutex_);
    data_->under_way_.clear();
  }

 private:
  explicit Work(Data& data) : data_(&data) {}
  Data* data_;
};

Data::Data(Store& store, Skills& skills, const Clock& clock, Log& log, const Retention& retention)
    : store_(store), skills_(skills), clock_(clock), log_(log), retention_(retention) {
  if (!retention_.any()) return;
  thread_ = std::jthread([this](const std::stop_token& stop) {
    do {
      const Result<api::DataReport> done = ApplyRetention({});
      if (!done) log_.Warning("retention was not applied", {{"error", done.error().message}});
    } while (clock_.SleepFor(std::chrono::hours(1), stop));
  });
}

Result<std::vector<api::PersonInfo>> Data::ListPersons() { return store_.ListPersons(); }

Result<Data::Scope> Data::ScopeOf(const std::string& person) {
  Scope scope;
  Result<std::vector<std::string>> ids = store_.TrialIdsOf(person);
  if (!ids) return ids.error();
  scope.ids = *std::move(ids);
  scope.names.ids.insert(scope.ids.begin(), scope.ids.end());
  Result<std::vector<api::TrialInfo>> stored = store_.ListTrials("", person);
  if (!stored) return stored.error();
  scope.stored = *std::move(stored);
  for (const api::TrialInfo& trial : scope.stored) {
    scope.names.sources.insert({trial.skill, trial.source});
  }
  Result<std::vector<StoredVersion>> versions = store_.AllVersions();
  if (!versions) return versions.error();
  for (StoredVersion& version : *versions) {
    if (!Mentions(version, scope.names)) continue;
    std::vector<StoredVersion>& of_skill = scope.versions[version.skill];
    of_skill.push_back(std::move(version));
  }
  return scope;
}

Result<api::DataReport> Data::Foretell(const Scope& scope) {
  const Result<std::map<std::string, std::uint64_t>> bytes = store_.TrialBytes();
  if (!bytes) return bytes.error();
  api::DataReport report;
  for (const api::TrialInfo& trial : scope.stored) {
    report.items.push_back(DeletedTrial(trial, *bytes));
  }
  for (const auto& [skill, versions] : scope.versions) {
    for (const StoredVersion& version : versions) {
      api::DataItem item{.kind = "skill version",
                         .name = skill + " " + std::to_string(version.info.version),
                         .action = "deleted",
                         .at = version.info.learned};
      if (version.info.current) {
        std::size_t left = 0;
        for (const std::string& id : version.info.trial_ids) {
          left += !scope.names.ids.contains(id) && bytes->contains(id) ? 1 : 0;
        }
        item.detail = left == 0 ? "no trial is left to learn it anew from"
                                : "to be learned anew from " + std::to_string(left) + " trials";
      }
      report.items.push_back(std::move(item));
    }
  }
  return report;
}

Status Data::NoteErased(const std::string& person, const std::vector<std::string>& trials) {
  const Result<std::vector<api::ErasedPerson>> marks = store_.ErasedPersons();
  if (!marks) return marks.error();
  return store_.BeginErasure(trials, Mark(*marks, person, clock_.Now()));
}

Result<api::DataReport> Data::Carry(const Scope& scope, const std::string& person,
                                    const api::DataProgress& progress,
                                    const std::stop_token& stop) {
  const Result<std::map<std::string, std::uint64_t>> bytes = store_.TrialBytes();
  if (!bytes) return bytes.error();
  // First the trials, so that nothing is learned from them any more. Whose they were stays known
  // until all is done: an erasure that breaks off is taken up again by that.
  if (const Status begun = NoteErased(person, scope.ids); !begun) return begun.error();
  api::DataReport report;
  for (const api::TrialInfo& trial : scope.stored) {
    report.items.push_back(DeletedTrial(trial, *bytes));
  }
  constexpr double kTrialsGone = 0.1;
  constexpr double kSkillsDone = 0.9;
  double fraction = kTrialsGone;
  const double share = (kSkillsDone - kTrialsGone) /
                       static_cast<double>(std::max<std::size_t>(scope.versions.size(), 1));
  for (const auto& [skill, versions] : scope.versions) {
    const std::string& name = skill;
    const Result<std::vector<api::DataItem>> done = skills_.TakeOut(
        name, versions, scope.names,
        [&](double part, std::string_view step) {
          if (progress) progress(fraction + share * part, name + ": " + std::string(step));
        },
        stop);
    if (!done) {
      return WithPlace(done.error(),
                       "the trials are deleted; what was learned from them is not all gone yet, "
                       "run it again: skill \"" +
                           name + "\"");
    }
    report.items.insert(report.items.end(), done->begin(), done->end());
    fraction += share;
  }
  if (progress) progress(kSkillsDone, "rewriting the database");
  if (const Status finished = store_.FinishErasure(scope.ids); !finished) {
    return WithPlace(finished.error(),
                     "trials and skills are deleted; the database is not rewritten yet, run it "
                     "again");
  }
  report.items.push_back({.kind = "database",
                          .name = "learning.db",
                          .action = "rewritten",
                          .detail = "nothing of what was deleted is left in the file"});
  return report;
}

Result<api::DataReport> Data::Erase(const api::EraseRequest& request,
                                    const api::DataProgress& progress, std::stop_token stop) {
  if (const Status valid = api::CheckPerson(request.person, "person"); !valid) {
    return valid.error();
  }
  std::optional<Work> work;
  if (!request.dry_run) {
    Result<Work> begun = Work::Begin(*this, "another erasure");
    if (!begun) return begun.error();
    work.emplace(*std::move(begun));
  }
  const Result<Scope> scope = ScopeOf(request.person);
  if (!scope) return scope.error();
  if (request.dry_run) return Foretell(*scope);
  if (scope->ids.empty()) {
    const Result<bool> unfinished = store_.HasUnfinishedErasure();
    if (!unfinished) return unfinished.error();
    if (!*unfinished) {
      // Backups may hold what the store does not hold any more.
      if (const Status noted = NoteErased(request.person, {}); !noted) return noted.error();
      return api::DataReport();
    }
  }
  Result<api::DataReport> report = Carry(*scope, request.person, progress, stop);
  if (!report) return report;
  std::size_t trials = 0;
  std::size_t versions = 0;
  for (const api::DataItem& item : report->items) {
    trials += item.kind == "trial" ? 1 : 0;
    versions += item.kind == "skill version" && item.action == "deleted" ? 1 : 0;
  }
  log_.Info("audit", {{"method", "erasure of a person"},
                      {"target", std::to_string(trials) + " trials, " + std::to_string(versions) +
                                     " skill versions"},
                      {"outcome", "ok"}});
  return report;
}

void Data::Audit(const api::DataItem& item) {
  log_.Info("audit", {{"caller", "retention"},
                      {"method", item.action},
                      {"target", item.kind + " " + item.name},
                      {"outcome", "ok"}});
}

Result<api::DataReport> Data::ApplyRetention(const api::RetentionRequest& request) {
  std::optional<Work> work;
  if (!request.dry_run) {
    Result<Work> begun = Work::Begin(*this, "the removal of what is too old");
    if (!begun) return begun.error();
    work.emplace(*std::move(begun));
  }
  Retention retention = retention_;
  if (request.keep_days) retention.keep_trials_days = *request.keep_days;
  if (request.keep_versions_days) retention.keep_versions_days = *request.keep_versions_days;
  retention.needed_too = retention.needed_too || request.needed_too;
  return ApplyRetentionHeld(retention, request.dry_run);
}

Result<api::DataReport> Data::ApplyRetentionHeld(const Retention& retention, bool dry_run) {
  api::DataReport report;
  if (!retention.any()) {
    report.notices.emplace_back("nothing goes by age here: no --keep-trials-days is set");
    return report;
  }
  const Stamp now = clock_.Now();
  const auto is_old = [&](Stamp at, double keep_days) {
    return keep_days > 0 && ToSeconds(now - at) > keep_days * kSecondsOfDay;
  };
  const Result<std::vector<StoredVersion>> versions = store_.AllVersions();
  if (!versions) return versions.error();
  std::set<std::string> needed;
  std::map<std::string, std::vector<StoredVersion>> old_versions;
  for (const StoredVersion& version : *versions) {
    if (version.info.current) {
      needed.insert(version.info.trial_ids.begin(), version.info.trial_ids.end());
    } else if (is_old(version.info.learned, retention.keep_versions_days)) {
      old_versions[version.skill].push_back(version);
    }
  }
  const Result<std::vector<api::TrialInfo>> trials = store_.ListTrials("", "");
  if (!trials) return trials.error();
  const Result<std::map<std::string, std::uint64_t>> bytes = store_.TrialBytes();
  if (!bytes) return bytes.error();
  std::vector<std::string> old_trials;
  std::size_t kept = 0;
  for (const api::TrialInfo& trial : *trials) {
    if (!is_old(trial.submitted, retention.keep_trials_days)) continue;
    if (needed.contains(trial.id) && !retention.needed_too) {
      ++kept;
      continue;
    }
    old_trials.push_back(trial.id);
    report.items.push_back(DeletedTrial(trial, *bytes));
  }
  if (kept > 0) {
    report.notices.push_back(std::to_string(kept) +
                             " older trials stay: current skill versions were learned from them");
  }
  if (dry_run) {
    for (const auto& [skill, of_skill] : old_versions) {
      for (const StoredVersion& version : of_skill) {
        report.items.push_back({.kind = "skill version",
                                .name = skill + " " + std::to_string(version.info.version),
                                .action = "deleted",
                                .at = version.info.learned});
      }
    }
    return report;
  }
  for (const auto& [skill, of_skill] : old_versions) {
    const Result<std::vector<api::DataItem>> done = skills_.TakeOut(skill, of_skill, {}, {}, {});
    if (!done) {
      report.notices.push_back("skill \"" + skill + "\": " + done.error().message);
      continue;
    }
    report.items.insert(report.items.end(), done->begin(), done->end());
  }
  if (!old_trials.empty()) {
    if (const Status deleted = store_.DeleteTrials(old_trials); !deleted) return deleted.error();
  }
  for (const api::DataItem& item : report.items) Audit(item);
  return report;
}

Status Data::Backup(api::BackupSink& sink, std::stop_token stop) {
  const Result<Work> work = Work::Begin(*this, "a backup");
  if (!work) return work.error();
  return store_.BackUp(sink, stop);
}

Result<api::DataReport> Data::Restore(const api::RestoreRequest& request,
                                      api::BackupSource& source) {
  const Result<Work> work = Work::Begin(*this, "a restoring");
  if (!work) return work.error();
  if (request.plan.service != "learning") {
    return InvalidArgument(
        "the backup is one of \"" + request.plan.service + "\", must be of \"learning\"",
        "header.plan.service");
  }
  RestoreOutcome outcome;
  const Status restored = skills_.WhileNobodyLearns([&]() -> Status {
    Result<RestoreOutcome> done = store_.Restore(request, source);
    if (!done) return done.error();
    outcome = *std::move(done);
    skills_.Reload();
    return {};
  });
  if (!restored) return restored.error();
  for (const Relearning& lost : outcome.relearn) {
    const Result<api::DataItem> again = skills_.Relearn(lost, {}, {});
    if (!again) return WithPlace(again.error(), "all is restored but skill \"" + lost.skill + "\"");
    outcome.report.items.push_back(*again);
  }
  return std::move(outcome.report);
}

}  // namespace exemplar::learning_service
