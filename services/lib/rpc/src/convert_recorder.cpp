#include "convert_recorder.hpp"

namespace exemplar::rpc {

void ToProto(const api::RecordStart& request, v1::StartRecordingRequest* message) {
  message->set_name(Utf8(request.name));
  OptionsToProto(request.metadata, message->mutable_metadata());
  ToProto(request.expected_topics, message->mutable_expected_topics());
  message->set_timeout_s(request.timeout_s);
}

Result<api::RecordStart> FromProto(const v1::StartRecordingRequest& message) {
  constexpr double kLongestWait = 3600;
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
  return request;
}

void ToProto(const api::RecorderStatus& status, v1::RecorderStatus* message) {
  message->set_state(Utf8(status.state));
  message->set_detail(Utf8(status.detail));
  message->set_file(Utf8(status.file));
  message->set_duration_s(status.duration_s);
  message->set_messages(status.messages);
  message->set_bytes(status.bytes);
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
