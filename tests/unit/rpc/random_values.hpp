#pragma once
// Values drawn at random, every field set.

#include <string>
#include <vector>

#include "exemplar/api/services.hpp"
#include "exemplar/base/rng.hpp"

namespace exemplar::rpc {

inline Eigen::VectorXd RandomVector(Rng& rng, int size) {
  Eigen::VectorXd v(size);
  for (int i = 0; i < size; ++i) v[i] = rng.Normal();
  return v;
}

inline std::vector<double> RandomNumbers(Rng& rng, int size) {
  const Eigen::VectorXd v = RandomVector(rng, size);
  return {v.data(), v.data() + v.size()};
}

inline Eigen::MatrixXd RandomMatrix(Rng& rng, int rows, int columns) {
  Eigen::MatrixXd m(rows, columns);
  for (int c = 0; c < columns; ++c) m.col(c) = RandomVector(rng, rows);
  return m;
}

inline std::string RandomText(Rng& rng) { return "text-" + std::to_string(rng.Below(1'000'000)); }

inline std::vector<std::string> RandomTexts(Rng& rng, int size) {
  std::vector<std::string> texts;
  for (int i = 0; i < size; ++i) texts.push_back(RandomText(rng));
  return texts;
}

inline bool RandomBool(Rng& rng) { return rng.Below(2) == 1; }

inline Stamp RandomStamp(Rng& rng) {
  return Stamp::FromNanoseconds(static_cast<std::int64_t>(rng.Below(4'000'000'000'000'000'000)) -
                                1'000'000'000'000'000'000);
}

inline geometry::Pose RandomPose(Rng& rng) {
  geometry::Pose pose;
  pose.translation = RandomVector(rng, 3);
  pose.rotation = Eigen::Quaterniond(rng.Normal(), rng.Normal(), rng.Normal(), rng.Normal());
  pose.rotation.normalize();
  return pose;
}

inline std::vector<geometry::Pose> RandomPoses(Rng& rng, int size) {
  std::vector<geometry::Pose> poses;
  for (int i = 0; i < size; ++i) poses.push_back(RandomPose(rng));
  return poses;
}

inline geometry::NamedPose RandomNamedPose(Rng& rng) {
  geometry::NamedPose named{RandomText(rng), RandomPose(rng), RandomBool(rng)};
  if (!named.has_orientation) named.base_T_object.rotation.setIdentity();
  return named;
}

inline std::vector<geometry::NamedPose> RandomObjects(Rng& rng) {
  std::vector<geometry::NamedPose> objects;
  for (int i = 0; i < 3; ++i) objects.push_back(RandomNamedPose(rng));
  return objects;
}

inline demonstration::ScalarSeries RandomScalars(Rng& rng) {
  const int samples = 1 + static_cast<int>(rng.Below(20));
  const int channels = 1 + static_cast<int>(rng.Below(5));
  return {RandomTexts(rng, channels), RandomNumbers(rng, samples),
          RandomMatrix(rng, samples, channels)};
}

inline demonstration::PoseSeries RandomPoseSeries(Rng& rng) {
  const int samples = 1 + static_cast<int>(rng.Below(20));
  return {RandomText(rng), RandomNumbers(rng, samples), RandomPoses(rng, samples), RandomBool(rng)};
}

inline demonstration::Trial RandomTrial(Rng& rng) {
  demonstration::Trial trial;
  trial.source = RandomText(rng);
  trial.start = RandomStamp(rng);
  trial.joints = RandomScalars(rng);
  trial.prismatic_joints = RandomTexts(rng, 2);
  trial.measured_joints = RandomScalars(rng);
  trial.end_effectors = {RandomPoseSeries(rng), RandomPoseSeries(rng)};
  trial.objects = {RandomPoseSeries(rng)};
  trial.hands = RandomScalars(rng);
  trial.tactile = RandomScalars(rng);
  trial.wrench = RandomScalars(rng);
  trial.label = RandomScalars(rng);
  trial.notices = RandomTexts(rng, 3);
  return trial;
}

inline api::TrialInfo RandomTrialInfo(Rng& rng) {
  return {.id = RandomText(rng),
          .skill = RandomText(rng),
          .source = RandomText(rng),
          .submitted = RandomStamp(rng),
          .duration_s = rng.Uniform(),
          .streams = RandomTexts(rng, 4),
          .samples = rng.NextBits(),
          .notices = RandomTexts(rng, 2)};
}

inline demonstration::SkillQuery RandomQuery(Rng& rng) {
  demonstration::SkillQuery query;
  query.objects = RandomObjects(rng);
  query.start = RandomPose(rng);
  query.start_has_orientation = RandomBool(rng);
  if (!query.start_has_orientation) query.start->rotation.setIdentity();
  query.joint_start_names = RandomTexts(rng, 5);
  query.joint_start = RandomVector(rng, 5);
  return query;
}

inline demonstration::SkillMotion RandomMotion(Rng& rng) {
  const int frames = 2 + static_cast<int>(rng.Below(30));
  demonstration::SkillMotion motion;
  motion.skill = RandomText(rng);
  motion.version = static_cast<int>(rng.Below(100));
  motion.time_s = RandomNumbers(rng, frames);
  motion.joint_names = RandomTexts(rng, 7);
  motion.joints = RandomMatrix(rng, frames, 7);
  motion.base_T_tool = RandomPoses(rng, frames);
  motion.has_orientation = RandomBool(rng);
  motion.hand_open = RandomNumbers(rng, frames);
  motion.object_names = RandomTexts(rng, 2);
  motion.objectivity = RandomMatrix(rng, frames, 2);
  motion.sigma_m = RandomNumbers(rng, frames);
  motion.markers_s = RandomNumbers(rng, 3);
  motion.contacts = {{.object = RandomText(rng),
                      .first = 1,
                      .last = frames - 1,
                      .base_p_contact = RandomVector(rng, 3),
                      .touch_measured = RandomBool(rng)}};
  motion.objects = RandomObjects(rng);
  motion.warnings = RandomTexts(rng, 2);
  return motion;
}

inline learning::SkillReport RandomReport(Rng& rng) {
  learning::SkillReport report;
  report.skill = RandomText(rng);
  report.version = static_cast<int>(rng.Below(100));
  report.method = RandomText(rng);
  report.target = RandomText(rng);
  report.options = {{RandomText(rng), RandomText(rng)}, {"a", "b"}};
  report.frames = static_cast<int>(rng.Below(1000));
  report.duration_s = rng.Uniform();
  report.joint_names = RandomTexts(rng, 3);
  for (int i = 0; i < 3; ++i) {
    report.trials.push_back({.id = RandomText(rng),
                             .source = RandomText(rng),
                             .duration_s = rng.Uniform(),
                             .candidates = static_cast<int>(rng.Below(20)),
                             .markers_s = RandomNumbers(rng, 2),
                             .c = rng.Uniform(),
                             .k = rng.Uniform(),
                             .cutoff_hz = rng.Uniform(),
                             .base_T_target = RandomPose(rng),
                             .notes = RandomTexts(rng, 2)});
  }
  report.markers_s = RandomNumbers(rng, 2);
  if (RandomBool(rng)) report.contact_begin_s = rng.Uniform();
  if (RandomBool(rng)) report.contact_end_s = rng.Uniform();
  for (int i = 0; i < 2; ++i) {
    report.contacts.push_back({.object = RandomText(rng),
                               .begin_s = rng.Uniform(),
                               .end_s = rng.Uniform(),
                               .object_p_contact = RandomVector(rng, 3),
                               .spread_m = rng.Uniform(),
                               .touch_measured = RandomBool(rng)});
  }
  report.target_p_contact = RandomVector(rng, 3);
  report.contact_spread_m = rng.Uniform();
  report.mean_correlation = rng.Uniform();
  report.plain_correlation = rng.Uniform();
  report.methods = {{.method = RandomText(rng),
                     .frechet_m = rng.Uniform(),
                     .end_error_m = rng.Uniform(),
                     .frechet_by_trial_m = RandomNumbers(rng, 3),
                     .chosen = true}};
  report.notes = RandomTexts(rng, 2);
  report.warnings = RandomTexts(rng, 2);
  return report;
}

inline api::PlanSummary RandomPlan(Rng& rng) {
  return {.duration_s = rng.Uniform(),
          .frames = static_cast<int>(rng.Below(1000)),
          .max_position_error_m = rng.Uniform(),
          .max_contact_error_m = rng.Uniform(),
          .clearance_m = rng.Normal(),
          .clearance_between = RandomText(rng),
          .time_stretch = rng.Uniform(),
          .warnings = RandomTexts(rng, 2)};
}

inline api::ExecutionResult RandomExecution(Rng& rng) {
  api::ExecutionResult result;
  result.state = RandomText(rng);
  result.detail = RandomText(rng);
  result.plan = RandomPlan(rng);
  result.tracking_error_rad = rng.Uniform();
  result.clearance_m = rng.Uniform();
  if (RandomBool(rng)) result.contact_error_m = rng.Uniform();
  if (RandomBool(rng)) result.touch_onset_s = rng.Uniform();
  result.touch_max_n = rng.Uniform();
  result.commands_sent = rng.NextBits();
  result.lateness_p99_s = rng.Uniform();
  result.lateness_max_s = rng.Uniform();
  result.objects = RandomObjects(rng);
  result.base_T_tool = RandomPoses(rng, 8);
  result.tool_time_s = RandomNumbers(rng, 8);
  return result;
}

inline api::RobotStatus RandomRobotStatus(Rng& rng) {
  api::RobotStatus status;
  status.state = RandomText(rng);
  status.detail = RandomText(rng);
  status.speed = rng.Uniform();
  status.joint_names = RandomTexts(rng, 4);
  status.joints = RandomVector(rng, 4);
  status.state_age_s = rng.Uniform();
  status.base_T_tool = RandomPose(rng);
  status.objects = {{RandomNamedPose(rng), rng.Uniform()}, {RandomNamedPose(rng), rng.Uniform()}};
  return status;
}

inline api::RecorderStatus RandomRecorderStatus(Rng& rng) {
  return {.state = RandomText(rng),
          .detail = RandomText(rng),
          .file = RandomText(rng),
          .duration_s = rng.Uniform(),
          .messages = rng.NextBits(),
          .bytes = rng.NextBits(),
          .topics = {{.topic = RandomText(rng),
                      .type = RandomText(rng),
                      .sent = rng.NextBits(),
                      .received = rng.NextBits(),
                      .lost = rng.NextBits(),
                      .rate_hz = rng.Uniform(),
                      .has_schema = RandomBool(rng),
                      .writers = static_cast<int>(rng.Below(10))}}};
}

}  // namespace exemplar::rpc
