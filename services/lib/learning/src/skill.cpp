#include "exemplar/learning/skill.hpp"

#include <algorithm>
#include <cmath>

#include "exemplar/base/text.hpp"
#include "exemplar/learning/touch.hpp"
#include "exemplar/signal/statistics.hpp"
#include "frames_model.hpp"
#include "freed_memory.hpp"
#include "method_choice.hpp"
#include "paper_model.hpp"
#include "skill_data.hpp"
#include "trial_checks.hpp"

namespace exemplar::learning {
namespace {

// A trial whose left-out error is this many times the median is called an outlier.
constexpr double kOutlierFactor = 3;

// A method takes the place of those by path length when its left-out error is below this part of
// theirs.
constexpr double kClearlyBetter = 0.8;

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
    if (aligned.segmentation.c_replaced) {
      part.notes.push_back(
          "c of Eq. 3 is not positive (the deviation of the MSV is twice its mean or more): " +
          FormatDouble(part.c) + " was taken from the data");
    }
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
    SkillReport::ContactPart& part = report.contacts.emplace_back();
    part.object = exemplars.object_names[static_cast<std::size_t>(contact.object)];
    part.begin_s = data.alignment->time_s[static_cast<std::size_t>(contact.first)];
    part.end_s = data.alignment->time_s[static_cast<std::size_t>(contact.last)];
    part.touch_measured = contact.touch_measured;
    if (exemplars.has_tool) {
      part.object_p_contact = data.contact_points[k].object_p_contact;
      part.spread_m = data.contact_points[k].spread_m;
    }
    if (contact.object != exemplars.target || report.contact_begin_s.has_value()) continue;
    report.contact_begin_s = part.begin_s;
    report.contact_end_s = part.end_s;
    report.target_p_contact = part.object_p_contact;
    report.contact_spread_m = part.spread_m;
  }
  if (report.contact_begin_s.has_value()) return;
  if (exemplars.target >= 0 && exemplars.has_tool) {
    report.warnings.push_back(
        "no contact was found: no touch was measured and the paths do not converge in the frame of "
        "object \"" +
        report.target + "\"");
  }
}

void NameTarget(const Exemplars& exemplars, SkillReport& report) {
  if (exemplars.target < 0) {
    report.warnings.push_back(
        "the trials hold no object: answers differ by the start alone, if at all");
  } else {
    report.target = exemplars.object_names[static_cast<std::size_t>(exemplars.target)];
    if (report.options["target"].empty() && exemplars.objects() > 1) {
      report.warnings.push_back("no target was named: the paths converge most towards object \"" +
                                report.target + "\"");
    }
  }
  if (exemplars.size() == 1) {
    report.warnings.push_back(
        "one trial only: objectivity and errors cannot be measured, the motion moves with the "
        "object");
  }
}

std::vector<std::string> ChoicesOf(Method method, const Exemplars& exemplars) {
  if (method == Method::kPaper) return {kPaperChoice};
  std::vector<std::string> choices = {kFramesByLengthChoice, kFramesChoice};
  // Where contacts come from the motion, they are knots of a further alignment.
  if (!exemplars.trials[0].own_contacts.empty()) {
    choices.insert(choices.begin(), kFramesByContactChoice);
  }
  if (method == Method::kAuto) choices.push_back(kPaperChoice);
  return choices;
}

// The least left-out error of path and end together. Those by length give way only to one that
// is clearly better, since a few trials tell small differences badly (DECISIONS.md says how it came
// first).
std::string Choose(Method method, const Exemplars& exemplars, std::vector<MethodScore>& scores) {
  if (scores.empty()) {
    const bool frames = method != Method::kPaper && exemplars.has_tool;
    return frames || method == Method::kFrames ? ChoicesOf(method, exemplars).front()
                                               : kPaperChoice;
  }
  const auto error = [&](const MethodScore& score) {
    return (score.frechet_m + score.end_error_m) *
           (score.method == kFramesByContactChoice || score.method == kFramesByLengthChoice
                ? kClearlyBetter
                : 1.0);
  };
  MethodScore& best = *std::min_element(
      scores.begin(), scores.end(),
      [&](const MethodScore& a, const MethodScore& b) { return error(a) < error(b); });
  best.chosen = true;
  return best.method;
}

// Where each trial was predicted anew by the others, by that; else by the closed form.
void NoteOutliers(const Skill::Data& data, SkillReport& report) {
  constexpr std::size_t kLeast = 4;
  constexpr double kRounding_m = 1e-6;
  const std::vector<LeftOutTrial> left_out = data.model->LeftOut();
  if (left_out.size() < kLeast) return;
  std::vector<double> distances_m;
  for (const LeftOutTrial& trial : left_out) distances_m.push_back(trial.distance_m);
  for (const MethodScore& score : report.methods) {
    if (score.chosen && score.frechet_by_trial_m.size() == report.trials.size()) {
      distances_m = score.frechet_by_trial_m;
    }
  }
  const double median_m = signal::Quantile(distances_m, 0.5);
  // A trial at the edge of the others is predicted worse without being worse.
  std::vector<double> in_spreads;
  for (std::size_t j = 0; j < left_out.size(); ++j) {
    in_spreads.push_back(distances_m[j] / left_out[j].spread);
  }
  // An outlier spoils what is said of its neighbours, who are not named for it.
  const double least = std::max(kOutlierFactor * signal::Quantile(in_spreads, 0.5),
                                *std::max_element(in_spreads.begin(), in_spreads.end()) / 2);
  for (std::size_t j = 0; j < left_out.size(); ++j) {
    if (in_spreads[j] <= least || distances_m[j] <= median_m + kRounding_m) continue;
    report.trials[j].notes.push_back("outlier: the others predict it " +
                                     FormatFixed(distances_m[j], 3) + " m away, the median is " +
                                     FormatFixed(median_m, 3) + " m");
  }
}

// What the model did with the trials, and trials that do not fit the others.
void ReportModel(const Skill::Data& data, SkillReport& report) {
  if (const auto* frames = dynamic_cast<const FramesModel*>(data.model.get())) {
    report.notes.push_back(frames->Describe());
  } else if (const auto* paper = dynamic_cast<const PaperModel*>(data.model.get())) {
    if (data.exemplars->has_tool && !paper->through_joints()) {
      report.notes.push_back(
          "the trials have no joints (or there is no robot model): the paper's method is a plain "
          "RBF on paths");
    }
  }
  NoteOutliers(data, report);
  std::size_t with_touch = 0;
  std::vector<bool> touched;
  for (const AlignedTrial& trial : data.alignment->trials) {
    touched.push_back(trial.own.touch_n.size() > 0 && !FindTouches(trial.own.touch_n).empty());
    if (touched.back()) ++with_touch;
  }
  for (std::size_t j = 0; with_touch > 0 && j < touched.size(); ++j) {
    if (!touched[j]) {
      report.trials[j].notes.push_back("no touch was measured, where " +
                                       std::to_string(with_touch) + " other trials have it");
    }
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

std::shared_ptr<Skill::Data> MakeSkillData(
    SkillReport report, std::shared_ptr<const Alignment> alignment, Exemplars exemplars,
    std::string choice, std::shared_ptr<const demonstration::ToolKinematics> tool) {
  auto data = std::make_shared<Skill::Data>();
  data->report = std::move(report);
  data->alignment = std::move(alignment);
  data->tool = std::move(tool);
  data->choice = std::move(choice);
  exemplars = ExemplarsFor(data->choice, std::move(exemplars));
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
  data->exemplars = std::make_shared<const Exemplars>(exemplars.SituationsOnly());
  exemplars.DropTimes();
  ReturnFreedMemory();
  data->model = FitModel(data->choice, std::move(exemplars), data->tool);
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
  report.frames = static_cast<int>(alignment->time_s.size());
  report.duration_s = alignment->time_s.back();
  report.mean_correlation = alignment->mean_correlation;
  report.plain_correlation = alignment->plain_correlation;
  report.markers_s = alignment->markers_s;
  report.warnings.insert(report.warnings.end(), alignment->warnings.begin(),
                         alignment->warnings.end());
  Exemplars exemplars = BuildExemplars(*alignment, options.target, tool.get());
  NameTarget(exemplars, report);
  const std::vector<std::string> choices = ChoicesOf(options.method, exemplars);
  report.joint_names = exemplars.joint_names;
  // Scoring gives up what it no longer needs; what the model needs is then made again.
  report.methods = ScoreMethods(
      choices, std::move(exemplars), tool,
      [&](double fraction, std::string_view step) { tell(0.7 + 0.3 * fraction, step); }, stop);
  if (stop.stop_requested()) return Cancelled();
  ReturnFreedMemory();
  exemplars = BuildExemplars(*alignment, options.target, tool.get());
  const std::string choice = Choose(options.method, exemplars, report.methods);
  report.method = choice.substr(0, choice.find(' '));

  std::shared_ptr<Skill::Data> data =
      MakeSkillData(std::move(report), alignment, std::move(exemplars), choice, tool);
  ReportTrials(*alignment, *data->exemplars, data->report);
  ReportContact(*data, data->report);
  ReportModel(*data, data->report);
  tell(1.0, "done");
  return Skill(std::move(data));
}

}  // namespace exemplar::learning
