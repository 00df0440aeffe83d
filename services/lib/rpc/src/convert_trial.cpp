#include "convert_trial.hpp"

namespace exemplar::rpc {
namespace {

Status ReadSeries(const v1::ScalarSeries& message, std::string_view field,
                  demonstration::ScalarSeries& series) {
  Result<demonstration::ScalarSeries> read = FromProto(message, field);
  if (!read) return read.error();
  series = *std::move(read);
  return {};
}

Status ReadSeries(const google::protobuf::RepeatedPtrField<v1::PoseSeries>& message,
                  std::string_view field, std::vector<demonstration::PoseSeries>& series) {
  for (int i = 0; i < message.size(); ++i) {
    Result<demonstration::PoseSeries> read =
        FromProto(message[i], std::string(field) + "[" + std::to_string(i) + "]");
    if (!read) return read.error();
    series.push_back(*std::move(read));
  }
  return {};
}

void ToProto(const learning::Marker& marker, v1::Marker* message) {
  message->set_time_s(marker.time_s);
  message->set_frame(marker.frame);
  message->set_kind(marker.kind == learning::MarkerKind::kBeginning ? v1::Marker::KIND_BEGINNING
                                                                    : v1::Marker::KIND_ENDING);
  message->set_cause(Utf8(marker.cause));
  message->set_score(marker.score);
}

}  // namespace

void ToProto(const api::TrialInfo& info, v1::TrialInfo* message) {
  message->set_id(info.id);
  message->set_skill(Utf8(info.skill));
  message->set_source(Utf8(info.source));
  ToProto(info.submitted, message->mutable_submitted());
  message->set_duration_s(info.duration_s);
  ToProto(info.streams, message->mutable_streams());
  message->set_samples(info.samples);
  ToProto(info.notices, message->mutable_notices());
  message->set_person(Utf8(info.person));
}

api::TrialInfo FromProto(const v1::TrialInfo& message) {
  api::TrialInfo info;
  info.id = message.id();
  info.skill = message.skill();
  info.source = message.source();
  info.submitted = FromProto(message.submitted());
  info.duration_s = message.duration_s();
  info.streams = FromProto(message.streams());
  info.samples = message.samples();
  info.notices = FromProto(message.notices());
  info.person = message.person();
  return info;
}

void ToProto(const demonstration::Trial& trial, v1::Trial* message) {
  message->set_source(Utf8(trial.source));
  if (trial.start != Stamp()) ToProto(trial.start, message->mutable_start());
  if (!trial.joints.empty()) ToProto(trial.joints, message->mutable_joints());
  if (!trial.measured_joints.empty()) {
    ToProto(trial.measured_joints, message->mutable_measured_joints());
  }
  for (const auto& series : trial.end_effectors) ToProto(series, message->add_end_effectors());
  for (const auto& series : trial.objects) ToProto(series, message->add_objects());
  if (!trial.hands.empty()) ToProto(trial.hands, message->mutable_hands());
  if (!trial.tactile.empty()) ToProto(trial.tactile, message->mutable_tactile());
  if (!trial.wrench.empty()) ToProto(trial.wrench, message->mutable_wrench());
  if (!trial.label.empty()) ToProto(trial.label, message->mutable_label());
  ToProto(trial.notices, message->mutable_notices());
  ToProto(trial.prismatic_joints, message->mutable_prismatic_joints());
}

Result<demonstration::Trial> FromProto(const v1::Trial& message, std::string_view field) {
  const std::string place(field);
  demonstration::Trial trial;
  trial.source = message.source();
  if (message.has_start()) trial.start = FromProto(message.start());
  trial.notices = FromProto(message.notices());
  trial.prismatic_joints = FromProto(message.prismatic_joints());
  for (const Status& status :
       {ReadSeries(message.joints(), place + ".joints", trial.joints),
        ReadSeries(message.measured_joints(), place + ".measured_joints", trial.measured_joints),
        ReadSeries(message.end_effectors(), place + ".end_effectors", trial.end_effectors),
        ReadSeries(message.objects(), place + ".objects", trial.objects),
        ReadSeries(message.hands(), place + ".hands", trial.hands),
        ReadSeries(message.tactile(), place + ".tactile", trial.tactile),
        ReadSeries(message.wrench(), place + ".wrench", trial.wrench),
        ReadSeries(message.label(), place + ".label", trial.label)}) {
    if (!status) return status.error();
  }
  return trial;
}

void ToProto(const api::TrialSegments& segments, v1::SegmentTrialResponse* message) {
  message->set_id(Utf8(segments.id));
  ToProto(segments.time_s, message->mutable_time_s());
  const learning::Segmentation& segmentation = segments.segmentation;
  v1::Segmentation* out = message->mutable_segmentation();
  ToProto(segmentation.msv, out->mutable_msv());
  ToProto(segmentation.touch_term, out->mutable_touch_term());
  out->set_c(segmentation.c);
  out->set_k(segmentation.k);
  out->set_c_tactile(segmentation.c_tactile);
  out->set_c_replaced(segmentation.c_replaced);
  ToProto(segmentation.c_along, out->mutable_c_along());
  ToProto(segmentation.high_along, out->mutable_high_along());
  for (const learning::Marker& marker : segmentation.markers) ToProto(marker, out->add_markers());
}

Result<api::TrialSegments> FromProto(const v1::SegmentTrialResponse& message) {
  api::TrialSegments segments;
  segments.id = message.id();
  segments.time_s = FromProto(message.time_s());
  const v1::Segmentation& in = message.segmentation();
  learning::Segmentation& segmentation = segments.segmentation;
  segmentation.msv = VectorFromProto(in.msv());
  segmentation.touch_term = VectorFromProto(in.touch_term());
  segmentation.c = in.c();
  segmentation.k = in.k();
  segmentation.c_tactile = in.c_tactile();
  segmentation.c_replaced = in.c_replaced();
  segmentation.c_along = VectorFromProto(in.c_along());
  segmentation.high_along = VectorFromProto(in.high_along());
  for (const v1::Marker& marker : in.markers()) {
    segmentation.markers.push_back({.time_s = marker.time_s(),
                                    .frame = marker.frame(),
                                    .kind = marker.kind() == v1::Marker::KIND_ENDING
                                                ? learning::MarkerKind::kEnding
                                                : learning::MarkerKind::kBeginning,
                                    .cause = marker.cause(),
                                    .score = marker.score()});
  }
  return segments;
}

}  // namespace exemplar::rpc
