#include "convert_topic.hpp"

#include <cmath>

namespace exemplar::rpc {
namespace {

std::string ToBytes(const std::vector<std::uint8_t>& bytes) { return {bytes.begin(), bytes.end()}; }
std::vector<std::uint8_t> FromBytes(const std::string& bytes) {
  return {bytes.begin(), bytes.end()};
}

void ToProto(const api::TopicSample& sample, v1::TopicSample* message) {
  message->set_topic(Utf8(sample.topic));
  message->set_writer(Utf8(sample.writer));
  message->set_sequence(sample.sequence);
  message->set_source_stamp_ns(sample.source_stamp.nanoseconds());
  message->set_received_ns(sample.received.nanoseconds());
  if (!sample.cdr.empty()) message->set_cdr(ToBytes(sample.cdr));
  message->set_json(sample.json);
  message->set_json_error(Utf8(sample.json_error));
}

api::TopicSample FromProto(const v1::TopicSample& message) {
  return {.topic = message.topic(),
          .writer = message.writer(),
          .sequence = message.sequence(),
          .source_stamp = Stamp::FromNanoseconds(message.source_stamp_ns()),
          .received = Stamp::FromNanoseconds(message.received_ns()),
          .cdr = FromBytes(message.cdr()),
          .json = message.json(),
          .json_error = message.json_error()};
}

}  // namespace

void ToProto(const api::TopicInfo& info, v1::TopicInfo* message) {
  message->set_topic(Utf8(info.topic));
  message->set_type(Utf8(info.type));
  message->set_schema(Utf8(info.schema));
  message->set_keyed(info.keyed);
  message->set_reliable(info.reliable);
  message->set_transient_local(info.transient_local);
  message->set_writers(info.writers);
  message->set_received(info.received);
  message->set_lost(info.lost);
  message->set_rate_hz(info.rate_hz);
  message->set_bytes_per_s(info.bytes_per_s);
  message->set_subscriptions(info.subscriptions);
  message->set_may_publish(info.may_publish);
}

api::TopicInfo FromProto(const v1::TopicInfo& message) {
  return {.topic = message.topic(),
          .type = message.type(),
          .schema = message.schema(),
          .keyed = message.keyed(),
          .reliable = message.reliable(),
          .transient_local = message.transient_local(),
          .writers = message.writers(),
          .received = message.received(),
          .lost = message.lost(),
          .rate_hz = message.rate_hz(),
          .bytes_per_s = message.bytes_per_s(),
          .subscriptions = message.subscriptions(),
          .may_publish = message.may_publish()};
}

void ToProto(const api::TopicSubscription& subscription, v1::SubscribeTopicsRequest* message) {
  ToProto(subscription.topics, message->mutable_topics());
  message->set_max_rate_hz(subscription.max_rate_hz);
  message->set_queue(subscription.queue);
  message->set_content(!subscription.json ? v1::SubscribeTopicsRequest::CONTENT_RAW
                       : subscription.cdr ? v1::SubscribeTopicsRequest::CONTENT_RAW_AND_JSON
                                          : v1::SubscribeTopicsRequest::CONTENT_JSON);
  message->set_skip_last(!subscription.last);
}

Result<api::TopicSubscription> FromProto(const v1::SubscribeTopicsRequest& message) {
  if (!std::isfinite(message.max_rate_hz()) || message.max_rate_hz() < 0) {
    return InvalidArgument(
        "max_rate_hz is " + std::to_string(message.max_rate_hz()) + ", must be 0 or more",
        "max_rate_hz");
  }
  if (message.queue() < 0) {
    return InvalidArgument("queue is " + std::to_string(message.queue()) + ", must be 0 or more",
                           "queue");
  }
  const auto content = message.content();
  return api::TopicSubscription{.topics = FromProto(message.topics()),
                                .max_rate_hz = message.max_rate_hz(),
                                .queue = message.queue(),
                                .cdr = content != v1::SubscribeTopicsRequest::CONTENT_JSON,
                                .json = content == v1::SubscribeTopicsRequest::CONTENT_JSON ||
                                        content == v1::SubscribeTopicsRequest::CONTENT_RAW_AND_JSON,
                                .last = !message.skip_last()};
}

void ToProto(const api::TopicBatch& batch, v1::SubscribeTopicsResponse* message) {
  for (const api::TopicInfo& info : batch.topics) ToProto(info, message->add_topics());
  message->mutable_samples()->Reserve(static_cast<int>(batch.samples.size()));
  for (const api::TopicSample& sample : batch.samples) ToProto(sample, message->add_samples());
  message->set_missed(batch.missed);
}

api::TopicBatch FromProto(const v1::SubscribeTopicsResponse& message) {
  api::TopicBatch batch;
  for (const v1::TopicInfo& info : message.topics()) batch.topics.push_back(FromProto(info));
  batch.samples.reserve(static_cast<std::size_t>(message.samples_size()));
  for (const v1::TopicSample& sample : message.samples()) {
    batch.samples.push_back(FromProto(sample));
  }
  batch.missed = message.missed();
  return batch;
}

void ToProto(const api::TopicPublication& publication, v1::PublishSampleRequest* message) {
  message->set_topic(Utf8(publication.topic));
  message->set_type(Utf8(publication.type));
  message->set_schema(Utf8(publication.schema));
  if (publication.json.empty()) {
    message->set_cdr(ToBytes(publication.cdr));
  } else {
    message->set_json(Utf8(publication.json));
  }
}

Result<api::TopicPublication> FromProto(const v1::PublishSampleRequest& message) {
  if (message.topic().empty()) return InvalidArgument("a sample needs a topic", "topic");
  api::TopicPublication publication{
      .topic = message.topic(), .type = message.type(), .schema = message.schema()};
  if (message.has_json() && !message.json().empty()) {
    publication.json = message.json();
  } else if (message.has_cdr() && !message.cdr().empty()) {
    publication.cdr = FromBytes(message.cdr());
  } else {
    return InvalidArgument("a sample needs its bytes (cdr) or its members (json)", "sample");
  }
  return publication;
}

}  // namespace exemplar::rpc
