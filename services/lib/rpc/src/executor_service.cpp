#include <vector>

#include "convert_executor.hpp"
#include "exemplar/v1/executor.grpc.pb.h"
#include "server_call.hpp"

namespace exemplar::rpc {
namespace {

/// Work that outlives the call that began it. Thread-safe.
template <class Answer>
class DetachedRuns {
 public:
  using Tell = std::function<void(Answer)>;
  using Work = std::function<Result<Answer>(const Tell& tell, std::stop_token stop)>;

  explicit DetachedRuns(ServerShared& shared) : shared_(shared) {}

  /// Returns what the work tells first, or ends with.
  Result<Answer> Begin(Work work) {
    const auto progress = std::make_shared<Progress>();
    {
      const std::lock_guard lock(mutex_);
      std::erase_if(runs_, [](const Run& run) { return run.progress->Ended(); });
      runs_.push_back(
          {progress, std::jthread([this, work = std::move(work), progress](std::stop_token stop) {
             Do(work, *progress, std::move(stop));
           })});
    }
    return progress->Wait();
  }

 private:
  class Progress {
   public:
    void Tell(Result<Answer> answer) {
      const std::lock_guard lock(mutex_);
      if (first_) return;
      first_ = std::move(answer);
      told_.notify_all();
    }
    void End(Result<Answer> answer) {
      Tell(std::move(answer));
      ended_ = true;
    }
    bool Ended() const { return ended_; }
    Result<Answer> Wait() {
      std::unique_lock lock(mutex_);
      told_.wait(lock, [this] { return first_.has_value(); });
      return *first_;
    }

   private:
    std::mutex mutex_;
    std::condition_variable told_;
    std::optional<Result<Answer>> first_;
    std::atomic<bool> ended_{false};
  };
  struct Run {
    std::shared_ptr<Progress> progress;  // shared by the work's thread and the waiting call
    std::jthread thread;
  };

  void Do(const Work& work, Progress& progress, std::stop_token stop) {
    std::stop_source ends;
    const std::stop_callback on_end(std::move(stop), [&] { ends.request_stop(); });
    const std::stop_callback on_shutdown(shared_.shutdown().get_token(),
                                         [&] { ends.request_stop(); });
    progress.End(work([&](Answer answer) { progress.Tell(std::move(answer)); }, ends.get_token()));
  }

  ServerShared& shared_;
  std::mutex mutex_;
  std::vector<Run> runs_;
};

class ExecutorService final : public v1::ExecutorService::Service {
 public:
  ExecutorService(ServerShared& shared, api::ExecutorApi& executor)
      : shared_(shared), executor_(executor), motions_(shared), teleoperations_(shared) {}

  grpc::Status Plan(grpc::ServerContext* context, const v1::PlanRequest* request,
                    v1::PlanResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/Plan", [&]() -> Status {
      Result<api::ExecuteRequest> execution = FromProto(request->execution(), "execution");
      if (!execution) return execution.error();
      execution->client = WhoCalls(*context);
      const Result<api::PlanSummary> plan = executor_.Plan(*execution);
      if (!plan) return plan.error();
      ToProto(*plan, response->mutable_plan());
      return {};
    });
  }

  grpc::Status Execute(grpc::ServerContext* context, const v1::ExecuteRequest* request,
                       grpc::ServerWriter<v1::ExecuteResponse>* writer) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/Execute",
                 request->execution().skill().name(), [&]() -> Status {
                   Result<api::ExecuteRequest> execution =
                       FromProto(request->execution(), "execution");
                   if (!execution) return execution.error();
                   execution->client = WhoCalls(*context);
                   if (request->detached()) return PutResult(BeginMotion(*execution), writer);
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
                   return PutResult(result, writer);
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

  grpc::Status Teleoperate(grpc::ServerContext* context, const v1::TeleoperateRequest* request,
                           grpc::ServerWriter<v1::TeleoperateResponse>* writer) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/Teleoperate", [&]() -> Status {
      const api::TeleoperationRequest teleoperation = FromProto(*request);
      if (request->detached()) return PutResult(BeginTeleoperation(teleoperation), writer);
      CancellationWatch watch(shared_, *context);
      LatestWriter<v1::TeleoperateResponse> feedback(*writer, watch);
      const Result<api::TeleoperationResult> result = executor_.Teleoperate(
          teleoperation,
          [&](const api::TeleoperationFeedback& now) {
            v1::TeleoperateResponse message;
            ToProto(now, message.mutable_feedback());
            feedback.Post(std::move(message));
          },
          watch.token());
      feedback.Finish();
      return PutResult(result, writer);
    });
  }
  grpc::Status EndTeleoperation(grpc::ServerContext* context, const v1::EndTeleoperationRequest*,
                                v1::EndTeleoperationResponse*) override {
    return Serve(shared_, *context, "exemplar.v1.ExecutorService/EndTeleoperation",
                 [&] { return executor_.EndTeleoperation(); });
  }

 private:
  Result<api::ExecutionResult> BeginMotion(const api::ExecuteRequest& request) {
    return motions_.Begin([this, request](const auto& tell, const std::stop_token& stop) {
      return executor_.Execute(
          request,
          [&tell](const api::ExecutionFeedback& now) {
            if (now.state != "executing") return;
            api::ExecutionResult moving;
            moving.state = now.state;
            moving.plan.duration_s = now.duration_s;
            tell(std::move(moving));
          },
          stop);
    });
  }

  Result<api::TeleoperationResult> BeginTeleoperation(const api::TeleoperationRequest& request) {
    return teleoperations_.Begin([this, request](const auto& tell, const std::stop_token& stop) {
      return executor_.Teleoperate(
          request,
          [&tell](const api::TeleoperationFeedback& now) {
            api::TeleoperationResult on;
            on.state = now.state;
            on.detail = now.detail;
            tell(std::move(on));
          },
          stop);
    });
  }

  template <class Answer, class Response>
  static Status PutResult(const Result<Answer>& result, grpc::ServerWriter<Response>* writer) {
    if (!result) return result.error();
    Response last;
    ToProto(*result, last.mutable_result());
    writer->Write(last);
    return {};
  }

  ServerShared& shared_;
  api::ExecutorApi& executor_;
  DetachedRuns<api::ExecutionResult> motions_;
  DetachedRuns<api::TeleoperationResult> teleoperations_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeExecutorService(ServerShared& shared,
                                                   api::ExecutorApi& executor) {
  return std::make_unique<ExecutorService>(shared, executor);
}

}  // namespace exemplar::rpc
