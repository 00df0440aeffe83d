#include "exemplar/learning/skill.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "exemplar/base/text.hpp"
#include "paper_model.hpp"
#include "skill_data.hpp"
#include "trial_checks.hpp"

namespace exemplar::learning {
namespace {

Error Cancelled() { return {ErrorCode::kCancelled, "learning was cancelled"}; }

void ReportTrials(const Alignment& alignment, const Exemplars& exemplars, SkillReport& report) {
  for (std::size_t j = 0; j < alignment.trials.size(); ++j) {
    const AlignedTrial& aligned = alignment.trials[j];
    SkillReport::TrialPart& part = report.trials[j];
    part.duration_s = aligned.own.time_s.back();
    part.candidates = static_cast<int>(
        std::count_if(aligned.segmentation.markers.begin(), aligned.segmentation.markers.end(),
                      [](const Marker& m) { return m.kind == MarkerKind::kBeginning; }));
    for (const int m : aligned.chosen) {
      part.markers_s.push_back(aligned.segmentation.markers[static_cast<std::size_t>(m)].time_s);
    }
    part.c = aligned.segmentation.c;
    part.k = aligned.segmentation.k;
    part.cutoff_hz = aligned.own.cutoff_hz;
    if (exemplars.target >= 0) {
      part.base_T_target =
          exemplars.trials[j].situation.base_T_object[static_cast<std::size_t>(exemplars.target)];
    }
    part.notes.insert(part.notes.end(), aligned.own.notes.begin(), aligned.own.notes.end());
  }
}

void ReportContact(const Skill::Data& data, SkillReport& report) {
  const Exemplars& exemplars = *data.exemplars;
  for (std::size_t k = 0; k < exemplars.contacts.size(); ++k) {
    const ContactSpan& contact = exemplars.contacts[k];
    if (contact.object != exemplars.target) continue;
    report.contact_begin_s = data.alignment->time_s[static_cast<std::size_t>(contact.first)];
    report.contact_end_s = data.alignment->time_s[static_cast<std::size_t>(contact.last)];
    if (!exemplars.has_tool) return;
    report.target_p_contact = data.contact_points[k].object_p_contact;
    report.contact_spread_m = data.contact_points[k].spread_m;
    return;
  }
  if (exemplars.target >= 0 && exemplars.has_tool) {
    report.warnings.push_back(
        "no contact was found: no touch was measured and the paths do not converge in the frame of "
        "object \"" +
        report.target + "\"");
  }
}

}  // namespace

const SkillReport& Skill::report() const { return data_->report; }
const Alignment& Skill::alignment() const { return *data_->alignment; }

Skill Skill::Named(std::string name, int version) const {
  auto data = std::make_shared<Data>(*data_);
  data->report.skill = std::move(name);
  data->report.version = version;
  return Skill(std::move(data));
}

std::unique_ptr<const Model> FitModel(const std::string& /*choices*/, const Exemplars& exemplars,
                                      std::shared_ptr<const demonstration::ToolKinematics> tool) {
  return std::make_unique<PaperModel>(exemplars, std::move(tool));
}

std::shared_ptr<Skill::Data> MakeSkillData(
    SkillReport report, std::shared_ptr<const Alignment> alignment,
    std::shared_ptr<const demonstration::ToolKinematics> tool) {
  auto data = std::make_shared<Skill::Data>();
  data->report = std::move(report);
  data->alignment = std::move(alignment);
  data->tool = std::move(tool);
  data->exemplars = std::make_shared<const Exemplars>(
      BuildExemplars(*data->alignment, data->report.target, data->tool.get()));
  const Exemplars& exemplars = *data->exemplars;
  for (int o = 0; o < exemplars.objects(); ++o) {
    std::vector<Eigen::Quaterniond> rotations;
    for (const ExemplarTrial& trial : exemplars.trials) {
      rotations.push_back(trial.situation.base_T_object[static_cast<std::size_t>(o)].rotation);
    }
    data->mean_object_rotation.push_back(geometry::MeanRotation(rotations));
  }
  for (const ContactSpan& contact : exemplars.contacts) {
    data->contact_points.push_back(exemplars.has_tool ? MeanContactPoint(exemplars, contact)
                                                      : ContactPoint{});
  }
  return data;
}

Result<Skill> LearnSkill(std::span<const NamedTrial> trials, const LearnOptions& options,
                         std::shared_ptr<const demonstration::ToolKinematics> tool,
                         const Progress& progress, std::stop_token stop) {
  const auto tell = [&](double fraction, std::string_view step) {
    if (progress) progress(fraction, step);
  };
  SkillReport report;
  Result<std::vector<const NamedTrial*>> used = ChooseTrials(trials, options, report.warnings);
  if (!used.ok()) return used.error();

  std::vector<UniformTrial> prepared;
  for (const NamedTrial* named : *used) {
    if (stop.stop_requested()) return Cancelled();
    tell(0.2 * static_cast<double>(prepared.size()) / static_cast<double>(used->size()),
         "filtering " + named->id);
    Result<UniformTrial> uniform = Prepare(named->trial, options, tool.get());
    if (!uniform.ok()) {
      return WithPlace(uniform.error(), named->id.empty() ? named->trial.source : named->id);
    }
    uniform->id = named->id.empty() ? named->trial.source : named->id;
    SkillReport::TrialPart& part = report.trials.emplace_back();
    part.id = uniform->id;
    part.source = named->trial.source;
    part.notes = named->trial.notices;
    prepared.push_back(std::move(*uniform));
  }
  if (const Status same = MakeUniform(prepared, options, tool.get(), report.warnings); !same.ok()) {
    return same.error();
  }

  Result<Alignment> aligned = Align(
      std::move(prepared), options,
      [&](double fraction, std::string_view step) { tell(0.2 + 0.5 * fraction, step); }, stop);
  if (!aligned.ok()) return aligned.error();
  if (stop.stop_requested()) return Cancelled();

  tell(0.7, "interpolation");
  auto alignment = std::make_shared<const Alignment>(std::move(*aligned));
  report.options = options.ToStrings();
  report.target = options.target;
  report.frames = static_cast<int>(alignment->time_s.size());
  report.duration_s = alignment->time_s.back();
  report.mean_correlation = alignment->mean_correlation;
  report.plain_correlation = alignment->plain_correlation;
  report.markers_s = alignment->knots_s;
  report.warnings.insert(report.warnings.end(), alignment->warnings.begin(),
                         alignment->warnings.end());
  std::shared_ptr<Skill::Data> data = MakeSkillData(std::move(report), alignment, tool);
  const Exemplars& exemplars = *data->exemplars;
  SkillReport& final_report = data->report;
  final_report.joint_names = exemplars.joint_names;
  if (exemplars.target >= 0) {
    if (final_report.target.empty() && exemplars.objects() > 1) {
      final_report.warnings.push_back(
          "no target was named: the paths converge most towards object \"" +
          exemplars.object_names[static_cast<std::size_t>(exemplars.target)] + "\"");
    }
    final_report.target = exemplars.object_names[static_cast<std::size_t>(exemplars.target)];
  } else {
    final_report.warnings.push_back("the trials hold no object: every answer is the same motion");
  }
  if (exemplars.size() == 1) {
    final_report.warnings.push_back(
        "one trial only: objectivity and errors cannot be measured, the motion moves with the "
        "object from contact on");
  }
  ReportTrials(*alignment, exemplars, final_report);
  ReportContact(*data, final_report);
  final_report.method = "paper";
  data->choices = "paper";
  data->model = FitModel(data->choices, exemplars, tool);
  tell(1.0, "done");
  return Skill(std::move(data));
}

}  // namespace exemplar::learning
