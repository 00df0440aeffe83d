#include "learning/trials.hpp"

#include <algorithm>

#include "exemplar/api/data.hpp"
#include "exemplar/base/ids.hpp"
#include "exemplar/demonstration/csv.hpp"

namespace exemplar::learning_service {
namespace {

bool IsLetterOrDigit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

Result<api::TrialSegments> SegmentTrial(const demonstration::Trial& trial, std::string id,
                                        const std::map<std::string, std::string>& options,
                                        const demonstration::ToolKinematics* tool) {
  const Result<learning::LearnOptions> read = learning::LearnOptions::FromStrings(options);
  if (!read) {
    Error error = read.error();
    error.field = "options." + error.field;
    return error;
  }
  Result<learning::UniformTrial> uniform = learning::Prepare(trial, *read, tool);
  if (!uniform) return uniform.error();
  learning::Segmentation segmentation = learning::Segment(*uniform, *read);
  return api::TrialSegments{.id = std::move(id),
                            .time_s = std::move(uniform->time_s),
                            .segmentation = std::move(segmentation)};
}

/// `id` is taken by another trial only where two fingerprints meet by chance.
std::string MakeTrialId(const std::string& skill, const demonstration::Trial& trial, int attempt) {
  std::string text = skill + '\n' + TrialFingerprint(trial);
  if (attempt > 0) text += '\n' + std::to_string(attempt);
  return "trial-" + ContentHash(text);
}

}  // namespace

Status CheckSkillName(const std::string& name, std::string_view field) {
  constexpr std::size_t kLongest = 100;
  const bool valid = !name.empty() && name.size() <= kLongest && IsLetterOrDigit(name[0]) &&
                     std::all_of(name.begin(), name.end(), [](char c) {
                       return IsLetterOrDigit(c) || c == '_' || c == '-' || c == '.';
                     });
  if (valid) return {};
  return InvalidArgument("skill name \"" + name +
                             "\" must be 1 to 100 letters, digits, _ - or . and begin with a "
                             "letter or digit",
                         std::string(field));
}

Trials::Trials(Store& store, const Clock& clock,
               std::shared_ptr<const demonstration::ToolKinematics> tool, McapTrialReader read_mcap)
    : store_(store), clock_(clock), tool_(std::move(tool)), read_mcap_(std::move(read_mcap)) {}

Result<demonstration::Trial> Trials::Read(std::string_view name, std::string_view bytes) const {
  return ReadTrialFile(name, bytes, read_mcap_);
}

Result<api::SubmitResult> Trials::Duplicate(api::TrialInfo stored, const std::string& person) {
  if (!person.empty() && stored.person.empty()) {
    const Result<bool> set = store_.SetPerson(stored.id, person);
    if (!set) return set.error();
    stored.person = person;
  }
  if (!person.empty() && stored.person != person) {
    return FailedPrecondition("trial \"" + stored.id +
                                  "\" is stored already as another person's; `exemplar trial "
                                  "set-person` changes whose it is",
                              "person");
  }
  return api::SubmitResult{.info = std::move(stored), .duplicate = true};
}

Result<api::SubmitResult> Trials::Submit(const std::string& skill, const std::string& name,
                                         std::string file, const std::string& given_person) {
  if (const Status valid = CheckSkillName(skill, "skill"); !valid) return valid.error();
  const std::string person = given_person.empty() ? PersonOfFile(file) : given_person;
  if (!person.empty()) {
    if (const Status valid = api::CheckPerson(person, "person"); !valid) return valid.error();
  }
  const Result<demonstration::Trial> trial = Read(name, file);
  if (!trial) return trial.error();
  const std::lock_guard lock(submit_mutex_);
  for (int attempt = 0;; ++attempt) {
    const std::string id = MakeTrialId(skill, *trial, attempt);
    Result<std::optional<api::TrialInfo>> found = store_.FindTrial(id);
    if (!found) return found.error();
    if (*found) {
      const Result<demonstration::Trial> stored = Load(id);
      if (!stored) return stored.error();
      if (!SameContent(*stored, *trial)) continue;
      return Duplicate(**std::move(found), person);
    }
    api::TrialInfo info{.id = id,
                        .skill = skill,
                        .source = name,
                        .submitted = clock_.Now(),
                        .duration_s = trial->duration_s(),
                        .streams = StreamNames(*trial),
                        .samples = SampleCount(*trial),
                        .notices = trial->notices,
                        .person = person};
    if (const Status added = store_.AddTrial(info, file); !added) return added.error();
    return api::SubmitResult{.info = std::move(info), .duplicate = false};
  }
}

Result<std::vector<api::TrialInfo>> Trials::List(const std::string& skill,
                                                 const std::string& person) {
  return store_.ListTrials(skill, person);
}

Result<api::TrialInfo> Trials::Get(const std::string& id) {
  Result<std::optional<api::TrialInfo>> found = store_.FindTrial(id);
  if (!found) return found.error();
  if (!*found) return NotFound("there is no trial \"" + id + "\"", "id");
  return **std::move(found);
}

Result<demonstration::Trial> Trials::Load(const std::string& id) {
  const Result<api::TrialInfo> info = Get(id);
  if (!info) return info.error();
  const Result<std::string> file = store_.TrialFile(id);
  if (!file) return file.error();
  return Read(info->source, *file);
}

Result<api::TrialSegments> Trials::Segments(const std::string& id,
                                            const std::map<std::string, std::string>& options) {
  const Result<demonstration::Trial> trial = Load(id);
  if (!trial) return trial.error();
  return SegmentTrial(*trial, id, options, tool_.get());
}

Result<api::TrialSegments> Trials::SegmentsOfFile(
    const std::string& name, std::string file, const std::map<std::string, std::string>& options) {
  const Result<demonstration::Trial> trial = Read(name, file);
  if (!trial) return trial.error();
  return SegmentTrial(*trial, name, options, tool_.get());
}

Result<std::string> Trials::ExportCsv(const std::string& id) {
  const Result<demonstration::Trial> trial = Load(id);
  if (!trial) return trial.error();
  return demonstration::WriteCsv(*trial);
}

Status Trials::Delete(const std::string& id) {
  const Result<bool> deleted = store_.DeleteTrial(id);
  if (!deleted) return deleted.error();
  if (!*deleted) return NotFound("there is no trial \"" + id + "\"", "id");
  return {};
}

Status Trials::SetPerson(const std::string& id, const std::string& person) {
  if (!person.empty()) {
    if (Status valid = api::CheckPerson(person, "person"); !valid) return valid;
  }
  const Result<bool> set = store_.SetPerson(id, person);
  if (!set) return set.error();
  if (!*set) {
    return NotFound("there is no trial \"" + id + "\", and no skill was learned from one", "id");
  }
  return {};
}

}  // namespace exemplar::learning_service
