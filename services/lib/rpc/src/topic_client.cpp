#include "client_call.hpp"
#include "convert_topic.hpp"
#include "exemplar/v1/topic.grpc.pb.h"

namespace exemplar::rpc {
namespace {

using Stub = v1::TopicService::Stub;

class TopicClient final : public api::TopicApi {
 public:
  explicit TopicClient(std::shared_ptr<Connection> connection)
      : connection_(std::move(connection)), stub_(connection_->channel()) {}

  Result<std::vector<api::TopicInfo>> List(const std::vector<std::string>& topics) override {
    v1::ListTopicsRequest request;
    ToProto(topics, request.mutable_topics());
    const auto response = Call(*connection_, stub_, &Stub::List, request);
    if (!response) return response.error();
    std::vector<api::TopicInfo> list;
    for (const v1::TopicInfo& info : response->topics()) list.push_back(FromProto(info));
    return list;
  }

  Status Subscribe(const api::TopicSubscription& subscription,
                   const std::function<bool(const api::TopicBatch&)>& on_batch,
                   std::stop_token stop) override {
    v1::SubscribeTopicsRequest request;
    ToProto(subscription, &request);
    const auto context = connection_->Begin(Connection::Length::kOpenEnded);
    const CancelOnStop cancel(*context, stop);
    const auto reader = stub_.Subscribe(context.get(), request);
    v1::SubscribeTopicsResponse response;
    bool done = false;
    while (!done && reader->Read(&response)) {
      if (!on_batch(FromProto(response))) {
        done = true;
        context->TryCancel();
      }
    }
    const grpc::Status status = reader->Finish();
    if (status.ok() || done || stop.stop_requested()) return {};
    return FromGrpc(status, connection_->address());
  }

  Status Publish(const api::TopicPublication& publication) override {
    v1::PublishSampleRequest request;
    ToProto(publication, &request);
    const auto response = Call(*connection_, stub_, &Stub::Publish, request);
    return response ? Status() : response.error();
  }

 private:
  std::shared_ptr<Connection> connection_;
  Stub stub_;
};

}  // namespace

std::unique_ptr<api::TopicApi> MakeTopicClient(std::shared_ptr<Connection> connection) {
  return std::make_unique<TopicClient>(std::move(connection));
}

}  // namespace exemplar::rpc
