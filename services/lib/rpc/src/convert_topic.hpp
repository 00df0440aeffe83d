#pragma once
#include "convert_common.hpp"
#include "exemplar/api/topics.hpp"
#include "exemplar/v1/topic.pb.h"

namespace exemplar::rpc {

void ToProto(const api::TopicInfo& info, v1::TopicInfo* message);
api::TopicInfo FromProto(const v1::TopicInfo& message);

void ToProto(const api::TopicSubscription& subscription, v1::SubscribeTopicsRequest* message);
/// Errors: a rate or a queue that is negative or no number.
Result<api::TopicSubscription> FromProto(const v1::SubscribeTopicsRequest& message);

void ToProto(const api::TopicBatch& batch, v1::SubscribeTopicsResponse* message);
api::TopicBatch FromProto(const v1::SubscribeTopicsResponse& message);

void ToProto(const api::TopicPublication& publication, v1::PublishSampleRequest* message);
/// Errors: no topic, neither bytes nor JSON.
Result<api::TopicPublication> FromProto(const v1::PublishSampleRequest& message);

}  // namespace exemplar::rpc
