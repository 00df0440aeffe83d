#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string>

#include "exemplar/learning/skill.hpp"
#include "json_values.hpp"
#include "skill_data.hpp"

// Doubles are written with enough digits to read back the same, and everything else follows from
// the alignment and the choices in the report: a skill read back answers as the one written.

namespace exemplar::learning {
namespace {

using nlohmann::json;

constexpr int kFormat = 1;

// ---- alignment ----------------------------------------------------------------------------------

json FromUniform(const UniformTrial& trial) {
  json objects = json::array();
  for (std::size_t o = 0; o < trial.object_names.size(); ++o) {
    objects.push_back({{"name", trial.object_names[o]},
                       {"poses", FromPoses(trial.base_T_object[o])},
                       {"has_orientation", static_cast<bool>(trial.object_has_orientation[o])}});
  }
  return {{"id", trial.id},
          {"time_s", trial.time_s},
          {"joint_names", trial.joint_names},
          {"joints", FromMatrix(trial.joints)},
          {"base_T_tool", FromPoses(trial.base_T_tool)},
          {"has_orientation", trial.has_orientation},
          {"hand_open", trial.hand_open},
          {"touch_n", FromVector(trial.touch_n)},
          {"objects", std::move(objects)},
          {"cutoff_hz", trial.cutoff_hz},
          {"notes", trial.notes}};
}

UniformTrial ToUniform(const json& j) {
  UniformTrial trial;
  trial.id = j.at("id").get<std::string>();
  trial.time_s = ToNumbers(j.at("time_s"));
  trial.joint_names = j.at("joint_names").get<std::vector<std::string>>();
  trial.joints = ToMatrix(j.at("joints"));
  trial.base_T_tool = ToPoses(j.at("base_T_tool"));
  trial.has_orientation = j.at("has_orientation").get<bool>();
  trial.hand_open = ToNumbers(j.at("hand_open"));
  trial.touch_n = ToVector(j.at("touch_n"));
  for (const json& object : j.at("objects")) {
    trial.object_names.push_back(object.at("name").get<std::string>());
    trial.base_T_object.push_back(ToPoses(object.at("poses")));
    trial.object_has_orientation.push_back(object.at("has_orientation").get<bool>());
  }
  trial.cutoff_hz = j.at("cutoff_hz").get<double>();
  trial.notes = j.at("notes").get<std::vector<std::string>>();
  return trial;
}

json FromSegmentation(const Segmentation& segmentation) {
  json markers = json::array();
  for (const Marker& marker : segmentation.markers) {
    markers.push_back({{"time_s", marker.time_s},
                       {"frame", marker.frame},
                       {"beginning", marker.kind == MarkerKind::kBeginning},
                       {"cause", marker.cause},
                       {"score", marker.score}});
  }
  return {{"msv", FromVector(segmentation.msv)},
          {"touch_term", FromVector(segmentation.touch_term)},
          {"c", segmentation.c},
          {"k", segmentation.k},
          {"c_along", FromVector(segmentation.c_along)},
          {"high_along", FromVector(segmentation.high_along)},
          {"c_tactile", segmentation.c_tactile},
          {"c_replaced", segmentation.c_replaced},
          {"markers", std::move(markers)}};
}

Segmentation ToSegmentation(const json& j) {
  Segmentation segmentation;
  segmentation.msv = ToVector(j.at("msv"));
  segmentation.touch_term = ToVector(j.at("touch_term"));
  segmentation.c = j.at("c").get<double>();
  segmentation.k = j.at("k").get<double>();
  if (j.contains("c_along")) segmentation.c_along = ToVector(j.at("c_along"));
  if (j.contains("high_along")) segmentation.high_along = ToVector(j.at("high_along"));
  segmentation.c_tactile = j.at("c_tactile").get<double>();
  segmentation.c_replaced = j.at("c_replaced").get<bool>();
  for (const json& marker : j.at("markers")) {
    segmentation.markers.push_back(
        {.time_s = marker.at("time_s").get<double>(),
         .frame = marker.at("frame").get<int>(),
         .kind = marker.at("beginning").get<bool>() ? MarkerKind::kBeginning : MarkerKind::kEnding,
         .cause = marker.at("cause").get<std::string>(),
         .score = marker.at("score").get<double>()});
  }
  return segmentation;
}

json FromAlignment(const Alignment& alignment) {
  json trials = json::array();
  for (const AlignedTrial& trial : alignment.trials) {
    trials.push_back({{"id", trial.id},
                      {"own", FromUniform(trial.own)},
                      {"segmentation", FromSegmentation(trial.segmentation)},
                      {"chosen", trial.chosen},
                      {"own_knots_s", trial.own_knots_s}});
  }
  return {{"time_s", alignment.time_s},
          {"knots_s", alignment.knots_s},
          {"markers_s", alignment.markers_s},
          {"trials", std::move(trials)},
          {"canonical_joints", FromMatrix(alignment.canonical_joints)},
          {"canonical_tool", FromMatrix(alignment.canonical_tool)},
          {"mean_correlation", alignment.mean_correlation},
          {"plain_correlation", alignment.plain_correlation},
          {"warnings", alignment.warnings}};
}

Alignment ToAlignment(const json& j) {
  Alignment alignment;
  alignment.time_s = ToNumbers(j.at("time_s"));
  alignment.knots_s = ToNumbers(j.at("knots_s"));
  alignment.markers_s = j.contains("markers_s") ? ToNumbers(j.at("markers_s")) : alignment.knots_s;
  for (const json& trial : j.at("trials")) {
    alignment.trials.push_back({.id = trial.at("id").get<std::string>(),
                                .own = ToUniform(trial.at("own")),
                                .segmentation = ToSegmentation(trial.at("segmentation")),
                                .chosen = trial.at("chosen").get<std::vector<int>>(),
                                .own_knots_s = ToNumbers(trial.at("own_knots_s"))});
  }
  alignment.canonical_joints = ToMatrix(j.at("canonical_joints"));
  alignment.canonical_tool = ToMatrix(j.at("canonical_tool"));
  alignment.mean_correlation = j.at("mean_correlation").get<double>();
  alignment.plain_correlation = j.at("plain_correlation").get<double>();
  alignment.warnings = j.at("warnings").get<std::vector<std::string>>();
  return alignment;
}

// ---- report -------------------------------------------------------------------------------------

json FromPart(const SkillReport::TrialPart& part) {
  return {{"id", part.id},
          {"source", part.source},
          {"duration_s", part.duration_s},
          {"candidates", part.candidates},
          {"markers_s", part.markers_s},
          {"c", part.c},
          {"k", part.k},
          {"cutoff_hz", part.cutoff_hz},
          {"base_T_target", FromPose(part.base_T_target)},
          {"notes", part.notes}};
}

SkillReport::TrialPart ToPart(const json& j) {
  return {.id = j.at("id").get<std::string>(),
          .source = j.at("source").get<std::string>(),
          .duration_s = j.at("duration_s").get<double>(),
          .candidates = j.at("candidates").get<int>(),
          .markers_s = ToNumbers(j.at("markers_s")),
          .c = j.at("c").get<double>(),
          .k = j.at("k").get<double>(),
          .cutoff_hz = j.at("cutoff_hz").get<double>(),
          .base_T_target = ToPose(j.at("base_T_target")),
          .notes = j.at("notes").get<std::vector<std::string>>()};
}

json FromScore(const MethodScore& score) {
  return {{"method", score.method},
          {"frechet_m", score.frechet_m},
          {"end_error_m", score.end_error_m},
          {"frechet_by_trial_m", score.frechet_by_trial_m},
          {"chosen", score.chosen}};
}

MethodScore ToScore(const json& j) {
  return {.method = j.at("method").get<std::string>(),
          .frechet_m = j.at("frechet_m").get<double>(),
          .end_error_m = j.at("end_error_m").get<double>(),
          .frechet_by_trial_m = ToNumbers(j.at("frechet_by_trial_m")),
          .chosen = j.at("chosen").get<bool>()};
}

json FromContact(const SkillReport::ContactPart& part) {
  const Eigen::Vector3d& p = part.object_p_contact;
  return {{"object", part.object},     {"begin_s", part.begin_s},
          {"end_s", part.end_s},       {"object_p_contact", {p.x(), p.y(), p.z()}},
          {"spread_m", part.spread_m}, {"touch_measured", part.touch_measured}};
}

SkillReport::ContactPart ToContact(const json& j) {
  const auto p = j.at("object_p_contact").get<std::array<double, 3>>();
  return {.object = j.at("object").get<std::string>(),
          .begin_s = j.at("begin_s").get<double>(),
          .end_s = j.at("end_s").get<double>(),
          .object_p_contact = Eigen::Vector3d(p[0], p[1], p[2]),
          .spread_m = j.at("spread_m").get<double>(),
          .touch_measured = j.at("touch_measured").get<bool>()};
}

json FromOptional(const std::optional<double>& value) {
  return value.has_value() ? json(*value) : json(nullptr);
}

std::optional<double> ToOptional(const json& j) {
  return j.is_null() ? std::nullopt : std::optional<double>(j.get<double>());
}

SkillReport ToReport(const json& j) {
  SkillReport report;
  report.skill = j.at("skill").get<std::string>();
  report.version = j.at("version").get<int>();
  report.method = j.at("method").get<std::string>();
  report.target = j.at("target").get<std::string>();
  report.options = j.at("options").get<std::map<std::string, std::string>>();
  report.frames = j.at("frames").get<int>();
  report.duration_s = j.at("duration_s").get<double>();
  report.joint_names = j.at("joint_names").get<std::vector<std::string>>();
  for (const json& trial : j.at("trials")) report.trials.push_back(ToPart(trial));
  report.markers_s = ToNumbers(j.at("markers_s"));
  report.contact_begin_s = ToOptional(j.at("contact_begin_s"));
  report.contact_end_s = ToOptional(j.at("contact_end_s"));
  const auto contact = j.at("target_p_contact").get<std::array<double, 3>>();
  report.target_p_contact = Eigen::Vector3d(contact[0], contact[1], contact[2]);
  report.contact_spread_m = j.at("contact_spread_m").get<double>();
  if (j.contains("contacts")) {
    for (const json& part : j.at("contacts")) report.contacts.push_back(ToContact(part));
  } else if (report.contact_begin_s && report.contact_end_s) {
    // A skill that was stored before all were named.
    report.contacts.push_back({.object = report.target,
                               .begin_s = *report.contact_begin_s,
                               .end_s = *report.contact_end_s,
                               .object_p_contact = report.target_p_contact,
                               .spread_m = report.contact_spread_m,
                               .touch_measured = false});
  }
  report.mean_correlation = j.at("mean_correlation").get<double>();
  report.plain_correlation = j.at("plain_correlation").get<double>();
  for (const json& score : j.at("methods")) report.methods.push_back(ToScore(score));
  report.notes = j.at("notes").get<std::vector<std::string>>();
  report.warnings = j.at("warnings").get<std::vector<std::string>>();
  return report;
}

bool Increases(const std::vector<double>& values) {
  for (std::size_t k = 1; k < values.size(); ++k) {
    if (!(values[k] > values[k - 1])) return false;
  }
  return values.size() >= 2;
}

// What warping a trial and comparing it with the others takes for granted.
bool Fits(const AlignedTrial& trial, const Alignment& alignment) {
  const UniformTrial& first = alignment.trials.front().own;
  const UniformTrial& own = trial.own;
  const std::size_t frames = own.time_s.size();
  const auto rows = static_cast<Eigen::Index>(frames);
  bool good = Increases(own.time_s) && Increases(trial.own_knots_s) &&
              trial.own_knots_s.size() == alignment.knots_s.size() &&
              own.joint_names == first.joint_names && own.object_names == first.object_names &&
              own.base_T_tool.empty() == first.base_T_tool.empty() &&
              own.hand_open.empty() == first.hand_open.empty() &&
              (own.base_T_tool.empty() || own.base_T_tool.size() == frames) &&
              (own.hand_open.empty() || own.hand_open.size() == frames) &&
              own.joints.cols() == static_cast<Eigen::Index>(own.joint_names.size()) &&
              own.joints.rows() == rows && (own.touch_n.size() == 0 || own.touch_n.size() == rows);
  for (const PosePath& path : own.base_T_object) good = good && path.size() == frames;
  return good;
}

Status CheckShapes(const Alignment& alignment) {
  if (alignment.trials.empty() || !Increases(alignment.time_s) || !Increases(alignment.knots_s) ||
      alignment.canonical_joints.rows() != static_cast<Eigen::Index>(alignment.time_s.size())) {
    return Error{ErrorCode::kDataLoss, "skill JSON: alignment holds no motion", "alignment"};
  }
  for (const AlignedTrial& trial : alignment.trials) {
    if (!Fits(trial, alignment)) {
      return Error{ErrorCode::kDataLoss,
                   "skill JSON: trial \"" + trial.id + "\" does not fit the others", "alignment"};
    }
  }
  return {};
}

}  // namespace

json ToJson(const SkillReport& report) {
  json trials = json::array();
  for (const SkillReport::TrialPart& part : report.trials) trials.push_back(FromPart(part));
  json methods = json::array();
  for (const MethodScore& score : report.methods) methods.push_back(FromScore(score));
  json contacts = json::array();
  for (const SkillReport::ContactPart& part : report.contacts) {
    contacts.push_back(FromContact(part));
  }
  const Eigen::Vector3d& contact = report.target_p_contact;
  return {{"skill", report.skill},
          {"version", report.version},
          {"method", report.method},
          {"target", report.target},
          {"options", report.options},
          {"frames", report.frames},
          {"duration_s", report.duration_s},
          {"joint_names", report.joint_names},
          {"trials", std::move(trials)},
          {"markers_s", report.markers_s},
          {"contacts", std::move(contacts)},
          {"contact_begin_s", FromOptional(report.contact_begin_s)},
          {"contact_end_s", FromOptional(report.contact_end_s)},
          {"target_p_contact", {contact.x(), contact.y(), contact.z()}},
          {"contact_spread_m", report.contact_spread_m},
          {"mean_correlation", report.mean_correlation},
          {"plain_correlation", report.plain_correlation},
          {"methods", std::move(methods)},
          {"notes", report.notes},
          {"warnings", report.warnings}};
}

json ToJson(const Skill& skill) {
  return {{"format", kFormat},
          {"report", ToJson(skill.report())},
          {"alignment", FromAlignment(skill.alignment())},
          {"model", skill.data().choice}};
}

Result<Skill> SkillFromJson(const json& stored,
                            std::shared_ptr<const demonstration::ToolKinematics> tool) {
  try {
    if (const int format = stored.at("format").get<int>(); format != kFormat) {
      return Error{ErrorCode::kDataLoss,
                   "skill JSON: format is " + std::to_string(format) + ", this program reads " +
                       std::to_string(kFormat),
                   "format"};
    }
    SkillReport report = ToReport(stored.at("report"));
    auto alignment = std::make_shared<const Alignment>(ToAlignment(stored.at("alignment")));
    if (const Status good = CheckShapes(*alignment); !good.ok()) return good.error();
    const UniformTrial& first = alignment->trials.front().own;
    if (tool != nullptr && !first.joint_names.empty()) {
      for (const std::string& name : tool->joint_names()) {
        if (std::find(first.joint_names.begin(), first.joint_names.end(), name) ==
            first.joint_names.end()) {
          return FailedPrecondition("the robot model's joint \"" + name +
                                    "\" is not among the skill's");
        }
      }
    }
    auto choice = stored.at("model").get<std::string>();
    Exemplars exemplars = BuildExemplars(*alignment, report.target, tool.get());
    return Skill(MakeSkillData(std::move(report), std::move(alignment), std::move(exemplars),
                               std::move(choice), std::move(tool)));
  } catch (const json::exception& e) {
    return Error{ErrorCode::kDataLoss, std::string("skill JSON: ") + e.what(), "skill"};
  }
}

}  // namespace exemplar::learning
