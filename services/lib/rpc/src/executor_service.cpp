#include "convert_executor.hpp"
#include "exemplar/v1/executor.grpc.pb.h"
#include "server_call.hpp"

namespace exemplar::rpc {
namespace {

class ExecutorService final : public v1::ExecutorService::Service {
 public:
  ExecutorService(ServerShared& shared, api::ExecutorApi& executor)
      : shared_(shared), executor_(executor) {}

  grpc::Status Plan(grpc::ServerContext* context, const v1::PlanRequest* request,
                    v1::PlanResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/Plan", [&]() -> Status {
      const Result<api::ExecuteRequest> execution = FromProto(request->execution(), "execution");
      if (!execution) return execution.error();
      const Result<api::PlanSummary> plan = executor_.Plan(*execution);
      if (!plan) return plan.error();
      ToProto(*plan, response->mutable_plan());
      return {};
    });
  }

  grpc::Status Execute(grpc::ServerContext* context, const v1::ExecuteRequest* request,
                       grpc::ServerWriter<v1::ExecuteResponse>* writer) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/Execute", [&]() -> Status {
      const Result<api::ExecuteRequest> execution = FromProto(request->execution(), "execution");
      if (!execution) return execution.error();
      CancellationWatch watch(shared_, *context);
      LatestWriter<v1::ExecuteResponse> feedback(*writer, watch);
      const Result<api::ExecutionResult> result = executor_.Execute(
          *execution,
          [&](const api::ExecutionFeedback& now) {
            v1::ExecuteResponse message;
            ToProto(now, message.mutable_feedback());
            feedback.Post(std::move(message));
          },
          watch.token());
      feedback.Finish();
      if (!result) return result.error();
      v1::ExecuteResponse last;
      ToProto(*result, last.mutable_result());
      writer->Write(last);
      return {};
    });
  }

  grpc::Status GetStatus(grpc::ServerContext* context, const v1::GetRobotStatusRequest*,
                         v1::GetRobotStatusResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/GetStatus", [&]() -> Status {
      const Result<api::RobotStatus> status = executor_.GetStatus();
      if (!status) return status.error();
      ToProto(*status, response);
      return {};
    });
  }

  grpc::Status Pause(grpc::ServerContext* context, const v1::PauseRobotRequest*,
                     v1::PauseRobotResponse*) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/Pause",
                 [&] { return executor_.Pause(); });
  }
  grpc::Status Resume(grpc::ServerContext* context, const v1::ResumeRobotRequest*,
                      v1::ResumeRobotResponse*) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/Resume",
                 [&] { return executor_.Resume(); });
  }
  grpc::Status Cancel(grpc::ServerContext* context, const v1::CancelRobotRequest*,
                      v1::CancelRobotResponse*) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/Cancel",
                 [&] { return executor_.Cancel(); });
  }
  grpc::Status Stop(grpc::ServerContext* context, const v1::StopRobotRequest*,
                    v1::StopRobotResponse*) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/Stop",
                 [&] { return executor_.Stop(); });
  }
  grpc::Status Reset(grpc::ServerContext* context, const v1::ResetRobotRequest*,
                     v1::ResetRobotResponse*) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/Reset",
                 [&] { return executor_.Reset(); });
  }
  grpc::Status SetSpeed(grpc::ServerContext* context, const v1::SetRobotSpeedRequest* request,
                        v1::SetRobotSpeedResponse*) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/SetSpeed", [&]() -> Status {
      if (!(request->factor() > 0 && request->factor() <= 1)) {
        return InvalidArgument(
            "factor is " + std::to_string(request->factor()) + ", must be over 0 and at most 1",
            "factor");
      }
      return executor_.SetSpeed(request->factor());
    });
  }

 private:
  ServerShared& shared_;
  api::ExecutorApi& executor_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeExecutorService(ServerShared& shared,
                                                   api::ExecutorApi& executor) {
  return std::make_unique<ExecutorService>(shared, executor);
}

}  // namespace exemplar::rpc
