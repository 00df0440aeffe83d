#include "skill_text.hpp"

#include <algorithm>

#include "exemplar/base/text.hpp"
#include "screen.hpp"
#include "values.hpp"

namespace exemplar::cli {
namespace {

std::string Seconds(const std::vector<double>& times) {
  std::vector<std::string> words;
  words.reserve(times.size());
  for (const double time : times) words.push_back(FormatFixed(time, 2));
  return words.empty() ? "none" : Join(words, " ");
}

std::string Centimetres(double metres) { return FormatFixed(100 * metres, 2); }

/// "a few words" and what follows, the second column aligned.
std::string Line(const std::string& label, const std::string& value) {
  constexpr std::size_t kWidth = 14;
  return "  " + label + std::string(kWidth - std::min(kWidth, label.size()), ' ') + value + '\n';
}

std::string ContactText(const learning::SkillReport::ContactPart& contact) {
  const Eigen::Vector3d& p = contact.object_p_contact;
  return FormatFixed(contact.begin_s, 2) + " to " + FormatFixed(contact.end_s, 2) + " s, at " +
         FormatFixed(1e3 * p.x(), 1) + " " + FormatFixed(1e3 * p.y(), 1) + " " +
         FormatFixed(1e3 * p.z(), 1) + " mm in the frame of " + contact.object + ", spread " +
         FormatFixed(1e3 * contact.spread_m, 1) + " mm";
}

}  // namespace

std::string SuggestionsText(const learning::Suggestions& suggestions) {
  if (suggestions.places.empty()) return "no place tells more than another\n";
  std::string text = "demonstrate next with \"" + suggestions.places[0].target.name + "\" at\n";
  Table places({"X (m)", "Y (m)", "Z (m)", "WHY"});
  for (const learning::Suggestion& place : suggestions.places) {
    const Eigen::Vector3d& p = place.target.base_T_object.translation;
    places.Add({FormatFixed(p.x(), 3), FormatFixed(p.y(), 3), FormatFixed(p.z(), 3), place.reason});
  }
  text += places.Text(2);
  for (const std::string& note : suggestions.notes) text += "note: " + note + '\n';
  return text;
}

std::string ReportText(const learning::SkillReport& report) {
  std::string text = "skill " + report.skill + ", version " + std::to_string(report.version) + '\n';
  text += Line("method", report.method);
  text += Line("target", report.target.empty() ? "none" : report.target);
  text += Line("duration", FormatFixed(report.duration_s, 2) + " s, " +
                               std::to_string(report.frames) + " frames");
  text += Line("joints",
               report.joint_names.empty() ? "none (task space)" : Join(report.joint_names, " "));
  text += Line("markers", Seconds(report.markers_s) + " s");
  text += Line("correlation", FormatFixed(report.plain_correlation, 3) + " before alignment, " +
                                  FormatFixed(report.mean_correlation, 3) + " after");
  if (report.contacts.empty()) text += Line("contact", "none found");
  for (const learning::SkillReport::ContactPart& contact : report.contacts) {
    text += Line("contact", ContactText(contact));
  }

  text += "trials\n";
  Table trials({"TRIAL", "SOURCE", "SECONDS", "CANDIDATES", "MARKERS (s)", "TARGET AT (m)"});
  for (const auto& trial : report.trials) {
    const Eigen::Vector3d& p = trial.base_T_target.translation;
    trials.Add({trial.id, trial.source, FormatFixed(trial.duration_s, 2),
                std::to_string(trial.candidates), Seconds(trial.markers_s),
                FormatFixed(p.x(), 3) + " " + FormatFixed(p.y(), 3) + " " + FormatFixed(p.z(), 3)});
  }
  text += trials.Text(2);
  for (const auto& trial : report.trials) {
    for (const std::string& note : trial.notes) {
      const bool named = note.compare(0, trial.source.size(), trial.source) == 0;
      text += "  " + (named ? "" : trial.source + ": ") + note + '\n';
    }
  }

  if (!report.methods.empty()) {
    text += "methods, each trial predicted from the others\n";
    Table methods({"METHOD", "FRECHET (cm)", "END (cm)", "CHOSEN"});
    for (const learning::MethodScore& score : report.methods) {
      methods.Add({score.method, Centimetres(score.frechet_m), Centimetres(score.end_error_m),
                   score.chosen ? "yes" : ""});
    }
    text += methods.Text(2);
  }
  for (const std::string& note : report.notes) text += "note: " + note + '\n';
  for (const std::string& warning : report.warnings) text += "warning: " + warning + '\n';
  return text;
}

std::string MotionText(const demonstration::SkillMotion& motion) {
  std::string text = "skill " + motion.skill + ", version " + std::to_string(motion.version) + '\n';
  const double duration_s = motion.time_s.empty() ? 0 : motion.time_s.back();
  text += Line("duration",
               FormatFixed(duration_s, 2) + " s, " + std::to_string(motion.frames()) + " frames");
  for (const geometry::NamedPose& object : motion.objects) {
    text += Line("object",
                 object.name + " at " + PoseText(object.base_T_object, object.has_orientation));
  }
  if (!motion.base_T_tool.empty()) {
    text += Line("from", PoseText(motion.base_T_tool.front(), motion.has_orientation));
    text += Line("to", PoseText(motion.base_T_tool.back(), motion.has_orientation));
  }
  text += Line("markers", Seconds(motion.markers_s) + " s");
  for (const demonstration::Contact& contact : motion.contacts) {
    text +=
        Line("contact", contact.object + " from " + FormatFixed(motion.time_s[contact.first], 2) +
                            " to " + FormatFixed(motion.time_s[contact.last], 2) + " s" +
                            (contact.touch_measured ? "" : " (by the trials' spread)"));
  }
  if (!motion.sigma_m.empty()) {
    const auto [least, most] = std::minmax_element(motion.sigma_m.begin(), motion.sigma_m.end());
    text += Line("uncertainty", FormatFixed(1e3 * *least, 1) + " to " +
                                    FormatFixed(1e3 * *most, 1) + " mm (standard error)");
  }
  return text;
}

}  // namespace exemplar::cli
