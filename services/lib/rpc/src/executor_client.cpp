#include "client_call.hpp"
#include "convert_executor.hpp"
#include "exemplar/v1/executor.grpc.pb.h"

namespace exemplar::rpc {
namespace {

using Stub = v1::ExecutorService::Stub;

class ExecutorClient final : public api::ExecutorApi {
 public:
  explicit ExecutorClient(std::shared_ptr<Connection> connection)
      : connection_(std::move(connection)), stub_(connection_->channel()) {}

  Result<api::PlanSummary> Plan(const api::ExecuteRequest& execution) override {
    v1::PlanRequest request;
    ToProto(execution, request.mutable_execution());
    const auto response =
        Call(*connection_, stub_, &Stub::Plan, request, Connection::Length::kLong);
    if (!response) return response.error();
    return FromProto(response->plan());
  }

  Result<api::ExecutionResult> Execute(
      const api::ExecuteRequest& execution,
      const std::function<void(const api::ExecutionFeedback&)>& feedback,
      std::stop_token stop) override {
    v1::ExecuteRequest request;
    ToProto(execution, request.mutable_execution());
    request.set_detached(execution.detached);
    const auto context = connection_->Begin(Connection::Length::kLong);
    const CancelOnStop cancel(*context, std::move(stop));
    return ReadResult<api::ExecutionResult>(*stub_.Execute(context.get(), request), feedback);
  }

  Result<api::RobotStatus> GetStatus() override {
    const auto response = Call(*connection_, stub_, &Stub::GetStatus, v1::GetRobotStatusRequest());
    if (!response) return response.error();
    return FromProto(*response);
  }

  Status Pause() override { return Do(&Stub::Pause, v1::PauseRobotRequest()); }
  Status Resume() override { return Do(&Stub::Resume, v1::ResumeRobotRequest()); }
  Status Cancel() override { return Do(&Stub::Cancel, v1::CancelRobotRequest()); }
  Status Stop() override { return Do(&Stub::Stop, v1::StopRobotRequest()); }
  Status Reset() override { return Do(&Stub::Reset, v1::ResetRobotRequest()); }
  Status SetSpeed(double factor) override {
    v1::SetRobotSpeedRequest request;
    request.set_factor(factor);
    return Do(&Stub::SetSpeed, request);
  }
  Result<api::TeleoperationResult> Teleoperate(
      const api::TeleoperationRequest& teleoperation,
      const std::function<void(const api::TeleoperationFeedback&)>& feedback,
      std::stop_token stop) override {
    v1::TeleoperateRequest request;
    ToProto(teleoperation, &request);
    const auto context = connection_->Begin(Connection::Length::kLong);
    const CancelOnStop cancel(*context, std::move(stop));
    return ReadResult<api::TeleoperationResult>(*stub_.Teleoperate(context.get(), request),
                                                feedback);
  }
  Status EndTeleoperation() override {
    return Do(&Stub::EndTeleoperation, v1::EndTeleoperationRequest());
  }

 private:
  template <class Method, class Request>
  Status Do(Method method, const Request& request) {
    const auto response = Call(*connection_, stub_, method, request);
    if (!response) return response.error();
    return {};
  }

  /// The result behind a stream of feedback.
  template <class Value, class Response, class Feedback>
  Result<Value> ReadResult(grpc::ClientReader<Response>& reader, const Feedback& feedback) const {
    const auto last = ReadToLast(*connection_, reader, [&](const Response& response) {
      if (response.has_feedback() && feedback) feedback(FromProto(response.feedback()));
    });
    if (!last) return last.error();
    if (!last->has_result()) return Internal(connection_->address() + " sent no result");
    return FromProto(last->result());
  }

  std::shared_ptr<Connection> connection_;
  Stub stub_;
};

}  // namespace

std::unique_ptr<api::ExecutorApi> MakeExecutorClient(std::shared_ptr<Connection> connection) {
  return std::make_unique<ExecutorClient>(std::move(connection));
}

}  // namespace exemplar::rpc
