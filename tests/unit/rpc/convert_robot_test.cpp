#include <gtest/gtest.h>

#include <cmath>

#include "convert_executor.hpp"
#include "convert_recorder.hpp"
#include "random_values.hpp"

namespace exemplar::rpc {
namespace {

void ExpectSame(const geometry::Pose& a, const geometry::Pose& b) {
  EXPECT_EQ(a.translation, b.translation);
  EXPECT_EQ(a.rotation.coeffs(), b.rotation.coeffs());
}

void ExpectSame(const geometry::NamedPose& a, const geometry::NamedPose& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.has_orientation, b.has_orientation);
  ExpectSame(a.base_T_object, b.base_T_object);
}

void ExpectSame(const api::PlanSummary& a, const api::PlanSummary& b) {
  EXPECT_EQ(a.duration_s, b.duration_s);
  EXPECT_EQ(a.frames, b.frames);
  EXPECT_EQ(a.max_position_error_m, b.max_position_error_m);
  EXPECT_EQ(a.max_contact_error_m, b.max_contact_error_m);
  EXPECT_EQ(a.clearance_m, b.clearance_m);
  EXPECT_EQ(a.clearance_between, b.clearance_between);
  EXPECT_EQ(a.time_stretch, b.time_stretch);
  EXPECT_EQ(a.warnings, b.warnings);
}

TEST(ConvertExecutor, RequestsComeBack) {
  Rng rng(1);
  for (int i = 0; i < 50; ++i) {
    api::ExecuteRequest request;
    request.skill = RandomText(rng);
    request.version = static_cast<int>(rng.Below(9));
    request.objects = RandomObjects(rng);
    if (i % 2) request.start = RandomPose(rng);
    request.speed = rng.Uniform(0.01, 1);
    v1::SkillExecution message;
    ToProto(request, &message);
    const auto back = FromProto(message, "execution");
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->skill, request.skill);
    EXPECT_EQ(back->version, request.version);
    ASSERT_EQ(back->objects.size(), request.objects.size());
    for (std::size_t o = 0; o < request.objects.size(); ++o) {
      ExpectSame(back->objects[o], request.objects[o]);
    }
    ASSERT_EQ(back->start.has_value(), request.start.has_value());
    if (request.start) ExpectSame(*back->start, *request.start);
    EXPECT_EQ(back->speed, request.speed);
  }
}

TEST(ConvertExecutor, RejectsARequestThatCannotBeMeantAndNamesTheField) {
  v1::SkillExecution message;
  EXPECT_EQ(FromProto(message, "execution").error().field, "execution.skill.name");
  message.mutable_skill()->set_name("press");
  EXPECT_EQ(FromProto(message, "execution")->speed, 1);
  for (const double speed : {-0.1, 1.01, std::nan("")}) {
    message.set_speed(speed);
    EXPECT_EQ(FromProto(message, "execution").error().field, "execution.speed");
  }
  message.set_speed(1);
  ToProto(geometry::Pose::Identity(), false, message.mutable_start());
  EXPECT_EQ(FromProto(message, "execution").error().field, "execution.start.rotation");
}

TEST(ConvertExecutor, FeedbackComesBack) {
  const api::ExecutionFeedback feedback{
      .state = "executing", .time_s = 1, .duration_s = 2, .tracking_error_rad = 3, .touch_n = 4};
  v1::ExecutionFeedback message;
  ToProto(feedback, &message);
  const api::ExecutionFeedback back = FromProto(message);
  EXPECT_EQ(back.state, feedback.state);
  EXPECT_EQ(back.time_s, feedback.time_s);
  EXPECT_EQ(back.duration_s, feedback.duration_s);
  EXPECT_EQ(back.tracking_error_rad, feedback.tracking_error_rad);
  EXPECT_EQ(back.touch_n, feedback.touch_n);
}

TEST(ConvertExecutor, TeleoperationComesBack) {
  const api::TeleoperationRequest request{
      .suit = "gypsy", .touch = {"target", "block"}, .detached = true};
  v1::TeleoperateRequest asked;
  ToProto(request, &asked);
  EXPECT_EQ(FromProto(asked).suit, request.suit);
  EXPECT_EQ(FromProto(asked).touch, request.touch);
  EXPECT_TRUE(FromProto(asked).detached);

  for (const std::optional<double>& clearance : {std::optional<double>(), std::optional(0.02)}) {
    const api::TeleoperationFeedback feedback{.state = "teleoperating",
                                              .phase = "blocked",
                                              .detail = "wall",
                                              .time_s = 1,
                                              .behind_rad = 2,
                                              .behind_joint = "elbow",
                                              .tracking_error_rad = 3,
                                              .touch_n = 4,
                                              .clearance_m = clearance,
                                              .suit_rate_hz = 60};
    v1::TeleoperationFeedback told;
    ToProto(feedback, &told);
    const api::TeleoperationFeedback back = FromProto(told);
    EXPECT_EQ(back.state, feedback.state);
    EXPECT_EQ(back.phase, feedback.phase);
    EXPECT_EQ(back.detail, feedback.detail);
    EXPECT_EQ(back.time_s, feedback.time_s);
    EXPECT_EQ(back.behind_rad, feedback.behind_rad);
    EXPECT_EQ(back.behind_joint, feedback.behind_joint);
    EXPECT_EQ(back.tracking_error_rad, feedback.tracking_error_rad);
    EXPECT_EQ(back.touch_n, feedback.touch_n);
    EXPECT_EQ(back.clearance_m, feedback.clearance_m);
    EXPECT_EQ(back.suit_rate_hz, feedback.suit_rate_hz);

    const api::TeleoperationResult result{.state = "done",
                                          .detail = "off",
                                          .duration_s = 1,
                                          .following_s = 2,
                                          .suit_samples = 3,
                                          .suit_samples_left_out = 4,
                                          .commands_sent = 5,
                                          .holds = 6,
                                          .blocks = 7,
                                          .tracking_error_rad = 8,
                                          .clearance_m = clearance,
                                          .touch_max_n = 9,
                                          .latency_p50_s = 10,
                                          .latency_p99_s = 11,
                                          .latency_max_s = 12};
    v1::TeleoperationResult ended;
    ToProto(result, &ended);
    const api::TeleoperationResult end = FromProto(ended);
    EXPECT_EQ(end.state, result.state);
    EXPECT_EQ(end.detail, result.detail);
    EXPECT_EQ(end.duration_s, result.duration_s);
    EXPECT_EQ(end.following_s, result.following_s);
    EXPECT_EQ(end.suit_samples, result.suit_samples);
    EXPECT_EQ(end.suit_samples_left_out, result.suit_samples_left_out);
    EXPECT_EQ(end.commands_sent, result.commands_sent);
    EXPECT_EQ(end.holds, result.holds);
    EXPECT_EQ(end.blocks, result.blocks);
    EXPECT_EQ(end.tracking_error_rad, result.tracking_error_rad);
    EXPECT_EQ(end.clearance_m, result.clearance_m);
    EXPECT_EQ(end.touch_max_n, result.touch_max_n);
    EXPECT_EQ(end.latency_p50_s, result.latency_p50_s);
    EXPECT_EQ(end.latency_p99_s, result.latency_p99_s);
    EXPECT_EQ(end.latency_max_s, result.latency_max_s);
  }
}

TEST(ConvertExecutor, ResultsComeBack) {
  Rng rng(2);
  for (int i = 0; i < 50; ++i) {
    const api::ExecutionResult result = RandomExecution(rng);
    v1::ExecutionResult message;
    ToProto(result, &message);
    const auto back = FromProto(message);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->state, result.state);
    EXPECT_EQ(back->detail, result.detail);
    ExpectSame(back->plan, result.plan);
    EXPECT_EQ(back->tracking_error_rad, result.tracking_error_rad);
    EXPECT_EQ(back->clearance_m, result.clearance_m);
    EXPECT_EQ(back->contact_error_m, result.contact_error_m);
    EXPECT_EQ(back->touch_onset_s, result.touch_onset_s);
    EXPECT_EQ(back->touch_max_n, result.touch_max_n);
    EXPECT_EQ(back->commands_sent, result.commands_sent);
    EXPECT_EQ(back->lateness_p99_s, result.lateness_p99_s);
    EXPECT_EQ(back->lateness_max_s, result.lateness_max_s);
    ASSERT_EQ(back->objects.size(), result.objects.size());
    EXPECT_EQ(back->tool_time_s, result.tool_time_s);
    ASSERT_EQ(back->base_T_tool.size(), result.base_T_tool.size());
    for (std::size_t t = 0; t < result.base_T_tool.size(); ++t) {
      ExpectSame(back->base_T_tool[t], result.base_T_tool[t]);
    }
  }
}

TEST(ConvertExecutor, StatusesComeBack) {
  Rng rng(3);
  const api::RobotStatus status = RandomRobotStatus(rng);
  v1::GetRobotStatusResponse message;
  ToProto(status, &message);
  const auto back = FromProto(message);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(back->state, status.state);
  EXPECT_EQ(back->detail, status.detail);
  EXPECT_EQ(back->speed, status.speed);
  EXPECT_EQ(back->joint_names, status.joint_names);
  EXPECT_EQ(back->joints, status.joints);
  EXPECT_EQ(back->state_age_s, status.state_age_s);
  ExpectSame(back->base_T_tool, status.base_T_tool);
  ASSERT_EQ(back->objects.size(), 2u);
  ExpectSame(back->objects[1].pose, status.objects[1].pose);
  EXPECT_EQ(back->objects[1].age_s, status.objects[1].age_s);
}

TEST(ConvertRecorder, RequestsComeBack) {
  const api::RecordStart start{.name = "trial-001",
                               .metadata = {{"person", "anna"}},
                               .expected_topics = {"ircp/suit"},
                               .timeout_s = 7};
  v1::StartRecordingRequest message;
  ToProto(start, &message);
  const auto back = FromProto(message);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->name, start.name);
  EXPECT_EQ(back->metadata, start.metadata);
  EXPECT_EQ(back->expected_topics, start.expected_topics);
  EXPECT_EQ(back->timeout_s, start.timeout_s);
  message.set_timeout_s(-1);
  EXPECT_EQ(FromProto(message).error().field, "timeout_s");
}

TEST(ConvertRecorder, StatusesComeBack) {
  Rng rng(4);
  const api::RecorderStatus status = RandomRecorderStatus(rng);
  v1::RecorderStatus message;
  ToProto(status, &message);
  const api::RecorderStatus back = FromProto(message);
  EXPECT_EQ(back.state, status.state);
  EXPECT_EQ(back.detail, status.detail);
  EXPECT_EQ(back.file, status.file);
  EXPECT_EQ(back.duration_s, status.duration_s);
  EXPECT_EQ(back.messages, status.messages);
  EXPECT_EQ(back.bytes, status.bytes);
  ASSERT_EQ(back.topics.size(), 1u);
  EXPECT_EQ(back.topics[0].topic, status.topics[0].topic);
  EXPECT_EQ(back.topics[0].type, status.topics[0].type);
  EXPECT_EQ(back.topics[0].sent, status.topics[0].sent);
  EXPECT_EQ(back.topics[0].received, status.topics[0].received);
  EXPECT_EQ(back.topics[0].lost, status.topics[0].lost);
  EXPECT_EQ(back.topics[0].rate_hz, status.topics[0].rate_hz);
  EXPECT_EQ(back.topics[0].has_schema, status.topics[0].has_schema);
  EXPECT_EQ(back.topics[0].writers, status.topics[0].writers);
}

}  // namespace
}  // namespace exemplar::rpc
