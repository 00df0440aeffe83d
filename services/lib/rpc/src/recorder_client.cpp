#include "client_call.hpp"
#include "convert_recorder.hpp"
#include "exemplar/v1/recorder.grpc.pb.h"

namespace exemplar::rpc {
namespace {

using Stub = v1::RecorderService::Stub;

class RecorderClient final : public api::RecorderApi {
 public:
  explicit RecorderClient(std::shared_ptr<Connection> connection)
      : connection_(std::move(connection)), stub_(connection_->channel()) {}

  Result<api::RecorderStatus> Start(const api::RecordStart& start) override {
    v1::StartRecordingRequest request;
    ToProto(start, &request);
    // The recorder may wait for its writers as long as the request says.
    return Do(&Stub::Start, request, Connection::Length::kLong);
  }
  Result<api::RecorderStatus> Stop() override {
    return Do(&Stub::Stop, v1::StopRecordingRequest());
  }
  Result<api::RecorderStatus> Pause() override {
    return Do(&Stub::Pause, v1::PauseRecordingRequest());
  }
  Result<api::RecorderStatus> Resume() override {
    return Do(&Stub::Resume, v1::ResumeRecordingRequest());
  }
  Result<api::RecorderStatus> MarkEvent(const api::RecordEvent& event) override {
    v1::MarkEventRequest request;
    ToProto(event, &request);
    return Do(&Stub::MarkEvent, request);
  }
  Result<api::RecorderStatus> GetStatus() override {
    return Do(&Stub::GetStatus, v1::GetRecorderStatusRequest());
  }

 private:
  template <class Method, class Request>
  Result<api::RecorderStatus> Do(Method method, const Request& request,
                                 Connection::Length length = Connection::Length::kShort) {
    const auto response = Call(*connection_, stub_, method, request, length);
    if (!response) return response.error();
    return FromProto(response->status());
  }

  std::shared_ptr<Connection> connection_;
  Stub stub_;
};

}  // namespace

std::unique_ptr<api::RecorderApi> MakeRecorderClient(std::shared_ptr<Connection> connection) {
  return std::make_unique<RecorderClient>(std::move(connection));
}

}  // namespace exemplar::rpc
