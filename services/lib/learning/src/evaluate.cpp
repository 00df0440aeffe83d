#include <algorithm>
#include <cmath>

#include "deviation.hpp"
#include "exemplar/learning/skill.hpp"
#include "exemplar/learning/touch.hpp"
#include "skill_data.hpp"

namespace exemplar::learning {
namespace {

// The raw tool path of a trial's main hand; from `joints` where it has no poses.
Result<demonstration::PoseSeries> ToolPath(const demonstration::Trial& trial,
                                           const demonstration::ScalarSeries& joints,
                                           const demonstration::ToolKinematics* tool) {
  for (const demonstration::PoseSeries& hand : trial.end_effectors) {
    if (hand.name.empty()) return hand;
  }
  if (!trial.end_effectors.empty()) return trial.end_effectors.front();
  if (tool == nullptr || joints.empty()) {
    return InvalidArgument(
        "trial \"" + trial.source + "\" has no end-effector poses to compare with", "trial");
  }
  std::vector<Eigen::Index> columns;
  for (const std::string& name : tool->joint_names()) {
    const auto at = std::find(joints.names.begin(), joints.names.end(), name);
    if (at == joints.names.end()) {
      return InvalidArgument("trial \"" + trial.source + "\" has no joint \"" + name + "\"",
                             "trial");
    }
    columns.push_back(at - joints.names.begin());
  }
  demonstration::PoseSeries path;
  path.time_s = joints.time_s;
  Eigen::VectorXd q(static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index i = 0; i < joints.values.rows(); ++i) {
    for (std::size_t k = 0; k < columns.size(); ++k) {
      q[static_cast<Eigen::Index>(k)] = joints.values(i, columns[k]);
    }
    path.base_T_frame.push_back(tool->ToolPose(q));
  }
  return path;
}

double FirstTouchTime(const demonstration::Trial& trial, double otherwise) {
  if (trial.tactile.empty()) return otherwise;
  const Eigen::VectorXd touch = trial.tactile.values.rowwise().sum();
  const std::vector<Touch> touches = FindTouches(touch);
  return touches.empty() ? otherwise
                         : trial.tactile.time_s[static_cast<std::size_t>(touches.front().first)];
}

geometry::Pose PoseAt(const demonstration::PoseSeries& series, double time_s) {
  const auto after = std::upper_bound(series.time_s.begin(), series.time_s.end(), time_s);
  const auto index = static_cast<std::size_t>(after - series.time_s.begin());
  if (index == 0) return series.base_T_frame.front();
  if (index == series.time_s.size()) return series.base_T_frame.back();
  const double s =
      (time_s - series.time_s[index - 1]) / (series.time_s[index] - series.time_s[index - 1]);
  return geometry::Interpolate(series.base_T_frame[index - 1], series.base_T_frame[index], s);
}

}  // namespace

Result<Evaluation> Evaluate(const Skill& skill, const demonstration::Trial& trial) {
  const Skill::Data& data = skill.data();
  // As the skill was learned.
  const auto source = data.report.options.find("joints");
  const bool measured = source != data.report.options.end() && source->second == "measured";
  const Result<demonstration::PoseSeries> shown =
      ToolPath(trial, measured ? trial.measured_joints : trial.joints, data.tool.get());
  if (!shown.ok()) return shown.error();
  if (shown->empty()) {
    return InvalidArgument("trial \"" + trial.source + "\" has no samples", "trial");
  }
  double contact_part = 1;
  if (data.report.contact_begin_s.has_value() && data.report.duration_s > 0) {
    contact_part = *data.report.contact_begin_s / data.report.duration_s;
  }
  const double begin = shown->time_s.front();
  const double end = shown->time_s.back();
  const double contact_s = FirstTouchTime(trial, begin + contact_part * (end - begin));

  Evaluation evaluation;
  for (const std::string& name : data.exemplars->object_names) {
    const demonstration::PoseSeries* object = trial.FindObject(name);
    if (object == nullptr || object->empty()) continue;
    evaluation.query.objects.push_back({.name = name,
                                        .base_T_object = PoseAt(*object, contact_s),
                                        .has_orientation = object->has_orientation});
  }
  evaluation.query.start = shown->base_T_frame.front();
  evaluation.query.start_has_orientation = shown->has_orientation;
  Result<demonstration::SkillMotion> answer = Answer(skill, evaluation.query);
  if (!answer.ok()) return answer.error();
  if (answer->base_T_tool.empty()) {
    return FailedPrecondition("the skill answers with joints only: it has no robot model");
  }
  evaluation.deviation = Compare(answer->base_T_tool, shown->base_T_frame);
  evaluation.answer = std::move(*answer);
  return evaluation;
}

}  // namespace exemplar::learning
