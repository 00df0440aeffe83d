#include "convert_recorder.hpp"

namespace exemplar::rpc {

void ToProto(const api::RecordStart& request, v1::StartRecordingRequest* message) {
  message->set_name(Utf8(request.name));
  OptionsToProto(request.metadata, message->mutable_metadata());
  ToProto(request.expected_topics, message->mutable_expected_topics());
  message->set_timeout_s(request.timeout_s);
  message->set_split_bytes(request.split_bytes);
  message->set_split_s(request.split_s);
}

Result<api::RecordStart> FromProto(const v1::StartRecordingRequest& message) {
  constexpr double kLongestWait = 3600;
  constexpr double kLongestPart = 1e6;
  api::RecordStart request;
  request.name = message.name();
  request.metadata = OptionsFromProto(message.metadata());
  request.expected_topics = FromProto(message.expected_topics());
  if (message.timeout_s() != 0) request.timeout_s = message.timeout_s();
  if (!(request.timeout_s > 0 && request.timeout_s <= kLongestWait)) {
    return InvalidArgument(
        "timeout_s is " + std::to_string(request.timeout_s) + ", must be over 0 and at most 3600",
        "timeout_s");
  }
  request.split_bytes = message.split_bytes();
  request.split_s = message.split_s();
  if (!(request.split_s >= 0 && request.split_s <= kLongestPart)) {
    return InvalidArgument("split_s is " + std::to_string(request.split_s) +
                               ", must be between 0 and " + std::to_string(kLongestPart),
                           "split_s");
  }
  return request;
}

void ToProto(const api::RecordEvent& event, v1::MarkEventRequest* message) {
  message->set_note(Utf8(event.note));
  message->set_name(Utf8(event.name));
  OptionsToProto(event.metadata, message->mutable_metadata());
}

api::RecordEvent FromProto(const v1::MarkEventRequest& message) {
  return {.note = message.note(),
          .name = message.name(),
          .metadata = OptionsFromProto(message.metadata())};
}

void ToProto(const api::RecorderStatus& status, v1::RecorderStatus* message) {
  message->set_state(Utf8(status.state));
  message->set_detail(Utf8(status.detail));
  message->set_file(Utf8(status.file));
  message->set_duration_s(status.duration_s);
  message->set_messages(status.messages);
  message->set_bytes(status.bytes);
  message->set_lost(status.lost);
  message->set_rate_hz(status.rate_hz);
  message->set_bytes_per_s(status.bytes_per_s);
  message->set_disk_free_bytes(status.disk_free_bytes);
  message->set_part(status.part);
  message->set_pauses(status.pauses);
  message->set_left_out(status.left_out);
  message->set_buffered_s(status.buffered_s);
  for (const api::TopicFigures& topic : status.topics) {
    v1::TopicFigures* out = message->add_topics();
    out->set_topic(Utf8(topic.topic));
    out->set_type(Utf8(topic.type));
    out->set_sent(topic.sent);
    out->set_received(topic.received);
    out->set_lost(topic.lost);
    out->set_rate_hz(topic.rate_hz);
    out->set_has_schema(topic.has_schema);
    out->set_writers(topic.writers);
  }
}

api::RecorderStatus FromProto(const v1::RecorderStatus& message) {
  api::RecorderStatus status;
  status.state = message.state();
  status.detail = message.detail();
  status.file = message.file();
  status.duration_s = message.duration_s();
  status.messages = message.messages();
  status.bytes = message.bytes();
  status.lost = message.lost();
  status.rate_hz = message.rate_hz();
  status.bytes_per_s = message.bytes_per_s();
  status.disk_free_bytes = message.disk_free_bytes();
  status.part = message.part();
  status.pauses = message.pauses();
  status.left_out = message.left_out();
  status.buffered_s = message.buffered_s();
  for (const v1::TopicFigures& in : message.topics()) {
    api::TopicFigures& topic = status.topics.emplace_back();
    topic.topic = in.topic();
    topic.type = in.type();
    topic.sent = in.sent();
    topic.received = in.received();
    topic.lost = in.lost();
    topic.rate_hz = in.rate_hz();
    topic.has_schema = in.has_schema();
    topic.writers = in.writers();
  }
  return status;
}

}  // namespace exemplar::rpc
