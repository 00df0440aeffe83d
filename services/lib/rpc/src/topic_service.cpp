#include "convert_topic.hpp"
#include "exemplar/v1/topic.grpc.pb.h"
#include "server_call.hpp"

namespace exemplar::rpc {
namespace {

class TopicService final : public v1::TopicService::Service {
 public:
  TopicService(ServerShared& shared, api::TopicApi& topics) : shared_(shared), topics_(topics) {}

  grpc::Status List(grpc::ServerContext* context, const v1::ListTopicsRequest* request,
                    v1::ListTopicsResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.TopicService/List", [&]() -> Status {
      const Result<std::vector<api::TopicInfo>> list = topics_.List(FromProto(request->topics()));
      if (!list) return list.error();
      for (const api::TopicInfo& info : *list) ToProto(info, response->add_topics());
      return {};
    });
  }

  grpc::Status Subscribe(grpc::ServerContext* context, const v1::SubscribeTopicsRequest* request,
                         grpc::ServerWriter<v1::SubscribeTopicsResponse>* writer) override {
    return Serve(shared_, *context, "exemplar.v1.TopicService/Subscribe", [&]() -> Status {
      const Result<api::TopicSubscription> subscription = FromProto(*request);
      if (!subscription) return subscription.error();
      CancellationWatch watch(shared_, *context);
      v1::SubscribeTopicsResponse response;
      return topics_.Subscribe(
          *subscription,
          [&](const api::TopicBatch& batch) {
            response.Clear();
            ToProto(batch, &response);
            return writer->Write(response);
          },
          watch.token());
    });
  }

  grpc::Status Publish(grpc::ServerContext* context, const v1::PublishSampleRequest* request,
                       v1::PublishSampleResponse*) override {
    return Serve(shared_, *context, "exemplar.v1.TopicService/Publish", request->topic(),
                 [&]() -> Status {
                   const Result<api::TopicPublication> publication = FromProto(*request);
                   if (!publication) return publication.error();
                   return topics_.Publish(*publication);
                 });
  }

 private:
  ServerShared& shared_;
  api::TopicApi& topics_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeTopicService(ServerShared& shared, api::TopicApi& topics) {
  return std::make_unique<TopicService>(shared, topics);
}

}  // namespace exemplar::rpc
