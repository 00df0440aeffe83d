#include "convert_skill.hpp"

namespace exemplar::rpc {

void ToProto(const learning::SkillReport& report, v1::SkillReport* message) {
  message->set_skill(Utf8(report.skill));
  message->set_version(report.version);
  message->set_method(Utf8(report.method));
  message->set_target(Utf8(report.target));
  OptionsToProto(report.options, message->mutable_options());
  message->set_frames(report.frames);
  message->set_duration_s(report.duration_s);
  ToProto(report.joint_names, message->mutable_joint_names());
  for (const learning::SkillReport::TrialPart& trial : report.trials) {
    v1::SkillReport::TrialPart* out = message->add_trials();
    out->set_id(trial.id);
    out->set_source(Utf8(trial.source));
    out->set_duration_s(trial.duration_s);
    out->set_candidates(trial.candidates);
    ToProto(trial.markers_s, out->mutable_markers_s());
    out->set_c(trial.c);
    out->set_k(trial.k);
    out->set_cutoff_hz(trial.cutoff_hz);
    ToProto(trial.base_T_target, true, out->mutable_target_pose());
    ToProto(trial.notes, out->mutable_notes());
  }
  ToProto(report.markers_s, message->mutable_markers_s());
  if (report.contact_begin_s) message->set_contact_begin_s(*report.contact_begin_s);
  if (report.contact_end_s) message->set_contact_end_s(*report.contact_end_s);
  ToProto(report.target_p_contact, message->mutable_contact_point());
  message->set_contact_spread_m(report.contact_spread_m);
  message->set_mean_correlation(report.mean_correlation);
  message->set_plain_correlation(report.plain_correlation);
  for (const learning::MethodScore& score : report.methods) {
    v1::SkillReport::MethodScore* out = message->add_methods();
    out->set_method(Utf8(score.method));
    out->set_frechet_m(score.frechet_m);
    out->set_end_error_m(score.end_error_m);
    ToProto(score.frechet_by_trial_m, out->mutable_frechet_by_trial_m());
    out->set_chosen(score.chosen);
  }
  for (const learning::SkillReport::ContactPart& contact : report.contacts) {
    v1::SkillReport::ContactPart* out = message->add_contacts();
    out->set_object(Utf8(contact.object));
    out->set_begin_s(contact.begin_s);
    out->set_end_s(contact.end_s);
    ToProto(contact.object_p_contact, out->mutable_point());
    out->set_spread_m(contact.spread_m);
    out->set_touch_measured(contact.touch_measured);
  }
  ToProto(report.notes, message->mutable_notes());
  ToProto(report.warnings, message->mutable_warnings());
}

Result<learning::SkillReport> FromProto(const v1::SkillReport& message) {
  learning::SkillReport report;
  report.skill = message.skill();
  report.version = message.version();
  report.method = message.method();
  report.target = message.target();
  report.options = OptionsFromProto(message.options());
  report.frames = message.frames();
  report.duration_s = message.duration_s();
  report.joint_names = FromProto(message.joint_names());
  for (int i = 0; i < message.trials_size(); ++i) {
    const v1::SkillReport::TrialPart& in = message.trials(i);
    Result<ReadPose> pose =
        FromProto(in.target_pose(), "report.trials[" + std::to_string(i) + "].target_pose");
    if (!pose) return pose.error();
    learning::SkillReport::TrialPart& trial = report.trials.emplace_back();
    trial.id = in.id();
    trial.source = in.source();
    trial.duration_s = in.duration_s();
    trial.candidates = in.candidates();
    trial.markers_s = FromProto(in.markers_s());
    trial.c = in.c();
    trial.k = in.k();
    trial.cutoff_hz = in.cutoff_hz();
    trial.base_T_target = pose->pose;
    trial.notes = FromProto(in.notes());
  }
  report.markers_s = FromProto(message.markers_s());
  if (message.has_contact_begin_s()) report.contact_begin_s = message.contact_begin_s();
  if (message.has_contact_end_s()) report.contact_end_s = message.contact_end_s();
  report.target_p_contact = FromProto(message.contact_point());
  report.contact_spread_m = message.contact_spread_m();
  report.mean_correlation = message.mean_correlation();
  report.plain_correlation = message.plain_correlation();
  for (const v1::SkillReport::MethodScore& in : message.methods()) {
    learning::MethodScore& score = report.methods.emplace_back();
    score.method = in.method();
    score.frechet_m = in.frechet_m();
    score.end_error_m = in.end_error_m();
    score.frechet_by_trial_m = FromProto(in.frechet_by_trial_m());
    score.chosen = in.chosen();
  }
  for (const v1::SkillReport::ContactPart& in : message.contacts()) {
    learning::SkillReport::ContactPart& contact = report.contacts.emplace_back();
    contact.object = in.object();
    contact.begin_s = in.begin_s();
    contact.end_s = in.end_s();
    contact.object_p_contact = FromProto(in.point());
    contact.spread_m = in.spread_m();
    contact.touch_measured = in.touch_measured();
  }
  report.notes = FromProto(message.notes());
  report.warnings = FromProto(message.warnings());
  return report;
}

void ToProto(const api::SkillInfo& info, v1::SkillInfo* message) {
  message->set_name(Utf8(info.name));
  message->set_version(info.version);
  message->set_versions(info.versions);
  message->set_method(Utf8(info.method));
  message->set_target(Utf8(info.target));
  message->set_trials(info.trials);
  ToProto(info.learned, message->mutable_learned());
}

api::SkillInfo FromProto(const v1::SkillInfo& message) {
  api::SkillInfo info;
  info.name = message.name();
  info.version = message.version();
  info.versions = message.versions();
  info.method = message.method();
  info.target = message.target();
  info.trials = message.trials();
  info.learned = FromProto(message.learned());
  return info;
}

void ToProto(const api::VersionInfo& info, v1::SkillVersionInfo* message) {
  message->set_version(info.version);
  message->set_current(info.current);
  message->set_method(Utf8(info.method));
  ToProto(info.trial_ids, message->mutable_trial_ids());
  ToProto(info.learned, message->mutable_learned());
}

api::VersionInfo FromProto(const v1::SkillVersionInfo& message) {
  api::VersionInfo info;
  info.version = message.version();
  info.current = message.current();
  info.method = message.method();
  info.trial_ids = FromProto(message.trial_ids());
  info.learned = FromProto(message.learned());
  return info;
}

void ToProto(const demonstration::SkillQuery& query, v1::SkillQuery* message) {
  ToProto(query.objects, message->mutable_objects());
  if (query.start) ToProto(*query.start, query.start_has_orientation, message->mutable_start());
  ToProto(query.joint_start_names, message->mutable_joint_start_names());
  if (query.joint_start) ToProto(*query.joint_start, message->mutable_joint_start());
}

Result<demonstration::SkillQuery> FromProto(const v1::SkillQuery& message, std::string_view field) {
  const std::string place(field);
  demonstration::SkillQuery query;
  Result<std::vector<geometry::NamedPose>> objects =
      FromProto(message.objects(), place + ".objects");
  if (!objects) return objects.error();
  query.objects = *std::move(objects);
  if (message.has_start()) {
    Result<ReadPose> start = FromProto(message.start(), place + ".start");
    if (!start) return start.error();
    query.start = start->pose;
    query.start_has_orientation = start->has_orientation;
  }
  query.joint_start_names = FromProto(message.joint_start_names());
  if (message.joint_start_size() > 0) {
    query.joint_start = VectorFromProto(message.joint_start());
    if (!query.joint_start->allFinite()) {
      return InvalidArgument(place + ".joint_start is not finite", place + ".joint_start");
    }
  }
  if (!query.joint_start_names.empty() &&
      query.joint_start_names.size() != static_cast<std::size_t>(message.joint_start_size())) {
    return InvalidArgument(place + ".joint_start holds " +
                               std::to_string(message.joint_start_size()) + " values for " +
                               std::to_string(query.joint_start_names.size()) + " names",
                           place + ".joint_start");
  }
  return query;
}

void ToProto(const demonstration::SkillMotion& motion, v1::SkillMotion* message) {
  ToProtoWithoutArrays(motion, message);
  ToProto(motion.time_s, message->mutable_time_s());
  MatrixToProto(motion.joints, message->mutable_joints());
  PosesToProto(motion.base_T_tool, message->mutable_tool());
  ToProto(motion.hand_open, message->mutable_hand_open());
  MatrixToProto(motion.objectivity, message->mutable_objectivity());
  ToProto(motion.sigma_m, message->mutable_sigma_m());
}

void ToProtoWithoutArrays(const demonstration::SkillMotion& motion, v1::SkillMotion* message) {
  message->set_skill(Utf8(motion.skill));
  message->set_version(motion.version);
  ToProto(motion.joint_names, message->mutable_joint_names());
  message->set_has_orientation(motion.has_orientation);
  ToProto(motion.object_names, message->mutable_object_names());
  ToProto(motion.markers_s, message->mutable_markers_s());
  for (const demonstration::Contact& contact : motion.contacts) {
    v1::Contact* out = message->add_contacts();
    out->set_object(Utf8(contact.object));
    out->set_first(contact.first);
    out->set_last(contact.last);
    ToProto(contact.base_p_contact, out->mutable_point());
    out->set_touch_measured(contact.touch_measured);
  }
  ToProto(motion.objects, message->mutable_objects());
  ToProto(motion.warnings, message->mutable_warnings());
}

Result<demonstration::SkillMotion> FromProto(const v1::SkillMotion& message,
                                             std::string_view field) {
  const std::string place(field);
  demonstration::SkillMotion motion;
  motion.skill = message.skill();
  motion.version = message.version();
  motion.time_s = FromProto(message.time_s());
  const std::size_t frames = motion.time_s.size();
  motion.joint_names = FromProto(message.joint_names());
  Result<Eigen::MatrixXd> joints =
      MatrixFromProto(message.joints(), frames, motion.joint_names.size(), place + ".joints");
  if (!joints) return joints.error();
  motion.joints = *std::move(joints);
  Result<std::vector<geometry::Pose>> tool = PosesFromProto(message.tool(), place + ".tool");
  if (!tool) return tool.error();
  motion.base_T_tool = *std::move(tool);
  motion.has_orientation = message.has_orientation();
  motion.hand_open = FromProto(message.hand_open());
  motion.object_names = FromProto(message.object_names());
  Result<Eigen::MatrixXd> objectivity = MatrixFromProto(
      message.objectivity(), frames, motion.object_names.size(), place + ".objectivity");
  if (!objectivity) return objectivity.error();
  motion.objectivity = *std::move(objectivity);
  motion.sigma_m = FromProto(message.sigma_m());
  const auto fits = [&](std::size_t size) { return size == 0 || size == frames; };
  if (!fits(motion.base_T_tool.size()) || !fits(motion.hand_open.size()) ||
      !fits(motion.sigma_m.size())) {
    return InvalidArgument(place + ": tool, hand_open and sigma_m must hold " +
                               std::to_string(frames) + " frames or none",
                           place);
  }
  motion.markers_s = FromProto(message.markers_s());
  for (int i = 0; i < message.contacts_size(); ++i) {
    const v1::Contact& in = message.contacts(i);
    if (in.first() < 0 || in.last() < in.first() || static_cast<std::size_t>(in.last()) >= frames) {
      const std::string contact = place + ".contacts[" + std::to_string(i) + "]";
      return InvalidArgument(contact + " is not within " + std::to_string(frames) + " frames",
                             contact);
    }
    motion.contacts.push_back({.object = in.object(),
                               .first = in.first(),
                               .last = in.last(),
                               .base_p_contact = FromProto(in.point()),
                               .touch_measured = in.touch_measured()});
  }
  Result<std::vector<geometry::NamedPose>> objects =
      FromProto(message.objects(), place + ".objects");
  if (!objects) return objects.error();
  motion.objects = *std::move(objects);
  motion.warnings = FromProto(message.warnings());
  return motion;
}

void ToProto(const learning::Evaluation& evaluation, v1::EvaluateSkillResponse* message) {
  message->set_frechet_m(evaluation.deviation.frechet_m);
  message->set_end_error_m(evaluation.deviation.end_error_m);
  message->set_end_angle_rad(evaluation.deviation.end_angle_rad);
  ToProto(evaluation.query, message->mutable_query());
  ToProto(evaluation.answer, message->mutable_answer());
}

Result<learning::Evaluation> FromProto(const v1::EvaluateSkillResponse& message) {
  Result<demonstration::SkillQuery> query = FromProto(message.query(), "query");
  if (!query) return query.error();
  Result<demonstration::SkillMotion> answer = FromProto(message.answer(), "answer");
  if (!answer) return answer.error();
  return learning::Evaluation{.deviation = {.frechet_m = message.frechet_m(),
                                            .end_error_m = message.end_error_m(),
                                            .end_angle_rad = message.end_angle_rad()},
                              .answer = *std::move(answer),
                              .query = *std::move(query)};
}

}  // namespace exemplar::rpc
