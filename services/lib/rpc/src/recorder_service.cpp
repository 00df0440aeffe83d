#include "convert_recorder.hpp"
#include "exemplar/v1/recorder.grpc.pb.h"
#include "server_call.hpp"

namespace exemplar::rpc {
namespace {

class RecorderService final : public v1::RecorderService::Service {
 public:
  RecorderService(ServerShared& shared, api::RecorderApi& recorder)
      : shared_(shared), recorder_(recorder) {}

  grpc::Status Start(grpc::ServerContext* context, const v1::StartRecordingRequest* request,
                     v1::StartRecordingResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.RecorderService/Start", [&]() -> Status {
      const Result<api::RecordStart> start = FromProto(*request);
      if (!start) return start.error();
      return Put(recorder_.Start(*start), response);
    });
  }
  grpc::Status Stop(grpc::ServerContext* context, const v1::StopRecordingRequest*,
                    v1::StopRecordingResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.RecorderService/Stop",
                 [&] { return Put(recorder_.Stop(), response); });
  }
  grpc::Status Pause(grpc::ServerContext* context, const v1::PauseRecordingRequest*,
                     v1::PauseRecordingResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.RecorderService/Pause",
                 [&] { return Put(recorder_.Pause(), response); });
  }
  grpc::Status Resume(grpc::ServerContext* context, const v1::ResumeRecordingRequest*,
                      v1::ResumeRecordingResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.RecorderService/Resume",
                 [&] { return Put(recorder_.Resume(), response); });
  }
  grpc::Status MarkEvent(grpc::ServerContext* context, const v1::MarkEventRequest* request,
                         v1::MarkEventResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.RecorderService/MarkEvent",
                 [&] { return Put(recorder_.MarkEvent(FromProto(*request)), response); });
  }
  grpc::Status GetStatus(grpc::ServerContext* context, const v1::GetRecorderStatusRequest*,
                         v1::GetRecorderStatusResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.RecorderService/GetStatus",
                 [&] { return Put(recorder_.GetStatus(), response); });
  }

 private:
  template <class Response>
  static Status Put(const Result<api::RecorderStatus>& status, Response* response) {
    if (!status) return status.error();
    ToProto(*status, response->mutable_status());
    return {};
  }

  ServerShared& shared_;
  api::RecorderApi& recorder_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeRecorderService(ServerShared& shared,
                                                   api::RecorderApi& recorder) {
  return std::make_unique<RecorderService>(shared, recorder);
}

}  // namespace exemplar::rpc
