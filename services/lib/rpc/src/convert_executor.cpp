#include "convert_executor.hpp"

namespace exemplar::rpc {

void ToProto(const api::ExecuteRequest& request, v1::SkillExecution* message) {
  message->mutable_skill()->set_name(Utf8(request.skill));
  message->mutable_skill()->set_version(request.version);
  ToProto(request.objects, message->mutable_objects());
  message->set_speed(request.speed);
  message->set_follow(request.follow);
  if (request.start) ToProto(*request.start, true, message->mutable_start());
}

Result<api::ExecuteRequest> FromProto(const v1::SkillExecution& message, std::string_view field) {
  const std::string place(field);
  if (message.skill().name().empty()) {
    return InvalidArgument(place + ".skill.name is empty", place + ".skill.name");
  }
  api::ExecuteRequest request;
  request.skill = message.skill().name();
  request.version = message.skill().version();
  Result<std::vector<geometry::NamedPose>> objects =
      FromProto(message.objects(), place + ".objects");
  if (!objects) return objects.error();
  request.objects = *std::move(objects);
  request.follow = message.follow();
  if (message.has_start()) {
    Result<ReadPose> start = FromProto(message.start(), place + ".start");
    if (!start) return start.error();
    if (!start->has_orientation) {
      return InvalidArgument(place + ".start.rotation is missing", place + ".start.rotation");
    }
    request.start = start->pose;
  }
  request.speed = message.speed() == 0 ? 1 : message.speed();
  if (!(request.speed > 0 && request.speed <= 1)) {
    return InvalidArgument(
        place + ".speed is " + std::to_string(request.speed) + ", must be over 0 and at most 1",
        place + ".speed");
  }
  return request;
}

void ToProto(const api::PlanSummary& plan, v1::PlanSummary* message) {
  message->set_duration_s(plan.duration_s);
  message->set_frames(plan.frames);
  message->set_max_position_error_m(plan.max_position_error_m);
  message->set_max_contact_error_m(plan.max_contact_error_m);
  message->set_clearance_m(plan.clearance_m);
  message->set_clearance_between(Utf8(plan.clearance_between));
  message->set_time_stretch(plan.time_stretch);
  ToProto(plan.warnings, message->mutable_warnings());
}

api::PlanSummary FromProto(const v1::PlanSummary& message) {
  api::PlanSummary plan;
  plan.duration_s = message.duration_s();
  plan.frames = message.frames();
  plan.max_position_error_m = message.max_position_error_m();
  plan.max_contact_error_m = message.max_contact_error_m();
  plan.clearance_m = message.clearance_m();
  plan.clearance_between = message.clearance_between();
  plan.time_stretch = message.time_stretch();
  plan.warnings = FromProto(message.warnings());
  return plan;
}

void ToProto(const api::ExecutionFeedback& feedback, v1::ExecutionFeedback* message) {
  message->set_state(Utf8(feedback.state));
  message->set_time_s(feedback.time_s);
  message->set_duration_s(feedback.duration_s);
  message->set_tracking_error_rad(feedback.tracking_error_rad);
  message->set_touch_n(feedback.touch_n);
}

api::ExecutionFeedback FromProto(const v1::ExecutionFeedback& message) {
  api::ExecutionFeedback feedback;
  feedback.state = message.state();
  feedback.time_s = message.time_s();
  feedback.duration_s = message.duration_s();
  feedback.tracking_error_rad = message.tracking_error_rad();
  feedback.touch_n = message.touch_n();
  return feedback;
}

void ToProto(const api::ExecutionResult& result, v1::ExecutionResult* message) {
  message->set_state(Utf8(result.state));
  message->set_detail(Utf8(result.detail));
  ToProto(result.plan, message->mutable_plan());
  message->set_tracking_error_rad(result.tracking_error_rad);
  message->set_clearance_m(result.clearance_m);
  if (result.contact_error_m) message->set_contact_error_m(*result.contact_error_m);
  if (result.touch_onset_s) message->set_touch_onset_s(*result.touch_onset_s);
  message->set_touch_max_n(result.touch_max_n);
  message->set_commands_sent(result.commands_sent);
  message->set_lateness_p99_s(result.lateness_p99_s);
  message->set_lateness_max_s(result.lateness_max_s);
  ToProto(result.objects, message->mutable_objects());
  v1::PoseSeries* tool = message->mutable_tool();
  ToProto(result.tool_time_s, tool->mutable_time_s());
  PosesToProto(result.base_T_tool, tool->mutable_poses());
  tool->set_has_orientation(true);
}

Result<api::ExecutionResult> FromProto(const v1::ExecutionResult& message) {
  api::ExecutionResult result;
  result.state = message.state();
  result.detail = message.detail();
  result.plan = FromProto(message.plan());
  result.tracking_error_rad = message.tracking_error_rad();
  result.clearance_m = message.clearance_m();
  if (message.has_contact_error_m()) result.contact_error_m = message.contact_error_m();
  if (message.has_touch_onset_s()) result.touch_onset_s = message.touch_onset_s();
  result.touch_max_n = message.touch_max_n();
  result.commands_sent = message.commands_sent();
  result.lateness_p99_s = message.lateness_p99_s();
  result.lateness_max_s = message.lateness_max_s();
  Result<std::vector<geometry::NamedPose>> objects = FromProto(message.objects(), "result.objects");
  if (!objects) return objects.error();
  result.objects = *std::move(objects);
  Result<demonstration::PoseSeries> tool = FromProto(message.tool(), "result.tool");
  if (!tool) return tool.error();
  result.base_T_tool = std::move(tool->base_T_frame);
  result.tool_time_s = std::move(tool->time_s);
  return result;
}

void ToProto(const api::RobotStatus& status, v1::GetRobotStatusResponse* message) {
  message->set_state(Utf8(status.state));
  message->set_detail(Utf8(status.detail));
  message->set_speed(status.speed);
  ToProto(status.joint_names, message->mutable_joint_names());
  ToProto(status.joints, message->mutable_joints());
  message->set_state_age_s(status.state_age_s);
  ToProto(status.base_T_tool, true, message->mutable_tool());
  for (const api::SeenObject& object : status.objects) {
    v1::SeenObject* out = message->add_objects();
    ToProto(object.pose, out->mutable_object());
    out->set_age_s(object.age_s);
  }
}

Result<api::RobotStatus> FromProto(const v1::GetRobotStatusResponse& message) {
  api::RobotStatus status;
  status.state = message.state();
  status.detail = message.detail();
  status.speed = message.speed();
  status.joint_names = FromProto(message.joint_names());
  status.joints = VectorFromProto(message.joints());
  status.state_age_s = message.state_age_s();
  Result<ReadPose> tool = FromProto(message.tool(), "tool");
  if (!tool) return tool.error();
  status.base_T_tool = tool->pose;
  for (int i = 0; i < message.objects_size(); ++i) {
    Result<geometry::NamedPose> pose =
        FromProto(message.objects(i).object(), "objects[" + std::to_string(i) + "].object");
    if (!pose) return pose.error();
    status.objects.push_back({*std::move(pose), message.objects(i).age_s()});
  }
  return status;
}

void ToProto(const api::TeleoperationRequest& request, v1::TeleoperateRequest* message) {
  message->set_suit(Utf8(request.suit));
  ToProto(request.touch, message->mutable_touch());
  message->set_detached(request.detached);
}

api::TeleoperationRequest FromProto(const v1::TeleoperateRequest& message) {
  return {message.suit(), FromProto(message.touch()), message.detached()};
}

void ToProto(const api::TeleoperationFeedback& feedback, v1::TeleoperationFeedback* message) {
  message->set_state(Utf8(feedback.state));
  message->set_phase(Utf8(feedback.phase));
  message->set_detail(Utf8(feedback.detail));
  message->set_time_s(feedback.time_s);
  message->set_behind_rad(feedback.behind_rad);
  message->set_behind_joint(Utf8(feedback.behind_joint));
  message->set_tracking_error_rad(feedback.tracking_error_rad);
  message->set_touch_n(feedback.touch_n);
  if (feedback.clearance_m) message->set_clearance_m(*feedback.clearance_m);
  message->set_suit_rate_hz(feedback.suit_rate_hz);
}

api::TeleoperationFeedback FromProto(const v1::TeleoperationFeedback& message) {
  api::TeleoperationFeedback feedback;
  feedback.state = message.state();
  feedback.phase = message.phase();
  feedback.detail = message.detail();
  feedback.time_s = message.time_s();
  feedback.behind_rad = message.behind_rad();
  feedback.behind_joint = message.behind_joint();
  feedback.tracking_error_rad = message.tracking_error_rad();
  feedback.touch_n = message.touch_n();
  if (message.has_clearance_m()) feedback.clearance_m = message.clearance_m();
  feedback.suit_rate_hz = message.suit_rate_hz();
  return feedback;
}

void ToProto(const api::TeleoperationResult& result, v1::TeleoperationResult* message) {
  message->set_state(Utf8(result.state));
  message->set_detail(Utf8(result.detail));
  message->set_duration_s(result.duration_s);
  message->set_following_s(result.following_s);
  message->set_suit_samples(result.suit_samples);
  message->set_suit_samples_left_out(result.suit_samples_left_out);
  message->set_commands_sent(result.commands_sent);
  message->set_holds(result.holds);
  message->set_blocks(result.blocks);
  message->set_tracking_error_rad(result.tracking_error_rad);
  if (result.clearance_m) message->set_clearance_m(*result.clearance_m);
  message->set_touch_max_n(result.touch_max_n);
  message->set_latency_p50_s(result.latency_p50_s);
  message->set_latency_p99_s(result.latency_p99_s);
  message->set_latency_max_s(result.latency_max_s);
}

api::TeleoperationResult FromProto(const v1::TeleoperationResult& message) {
  api::TeleoperationResult result;
  result.state = message.state();
  result.detail = message.detail();
  result.duration_s = message.duration_s();
  result.following_s = message.following_s();
  result.suit_samples = message.suit_samples();
  result.suit_samples_left_out = message.suit_samples_left_out();
  result.commands_sent = message.commands_sent();
  result.holds = message.holds();
  result.blocks = message.blocks();
  result.tracking_error_rad = message.tracking_error_rad();
  if (message.has_clearance_m()) result.clearance_m = message.clearance_m();
  result.touch_max_n = message.touch_max_n();
  result.latency_p50_s = message.latency_p50_s();
  result.latency_p99_s = message.latency_p99_s();
  result.latency_max_s = message.latency_max_s();
  return result;
}

}  // namespace exemplar::rpc
