#pragma once
#include <memory>

#include "exemplar/api/services.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/demonstration/tool_kinematics.hpp"
#include "learning/store.hpp"
#include "learning/trial_file.hpp"

namespace exemplar::learning_service {

/// The trials of all skills. Thread-safe.
class Trials final : public api::TrialApi {
 public:
  /// `tool` may be null: then trials need end-effector poses to be segmented. Store and clock must
  /// outlive this.
  Trials(Store& store, const Clock& clock,
         std::shared_ptr<const demonstration::ToolKinematics> tool, McapTrialReader read_mcap);

  Result<api::SubmitResult> Submit(const std::string& skill, const std::string& name,
                                   std::string file, const std::string& person = {}) override;
  Result<std::vector<api::TrialInfo>> List(const std::string& skill,
                                           const std::string& person = {}) override;
  Result<api::TrialInfo> Get(const std::string& id) override;
  Result<demonstration::Trial> Load(const std::string& id) override;
  Result<api::TrialSegments> Segments(const std::string& id,
                                      const std::map<std::string, std::string>& options) override;
  Result<api::TrialSegments> SegmentsOfFile(
      const std::string& name, std::string file,
      const std::map<std::string, std::string>& options) override;
  Result<std::string> ExportCsv(const std::string& id) override;
  Status Delete(const std::string& id) override;
  Status SetPerson(const std::string& id, const std::string& person) override;

  /// A trial from a file's bytes, stored or not.
  Result<demonstration::Trial> Read(std::string_view name, std::string_view bytes) const;

 private:
  /// The stored trial is said to be `person`'s once more.
  Result<api::SubmitResult> Duplicate(api::TrialInfo stored, const std::string& person);

  Store& store_;
  const Clock& clock_;
  const std::shared_ptr<const demonstration::ToolKinematics> tool_;
  const McapTrialReader read_mcap_;
  std::mutex submit_mutex_;  ///< between looking for a duplicate and storing
};

/// Names are parts of file names, addresses and command lines: letters, digits, `_`, `-`, `.`,
/// beginning with a letter or digit, at most 100.
Status CheckSkillName(const std::string& name, std::string_view field);

}  // namespace exemplar::learning_service
