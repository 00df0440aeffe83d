#include <vector>

#include "convert_executor.hpp"
#include "exemplar/v1/executor.grpc.pb.h"
#include "server_call.hpp"

namespace exemplar::rpc {
namespace {

/// Motions that outlive the call that began them. Thread-safe.
class DetachedMotions {
 public:
  DetachedMotions(ServerShared& shared, api::ExecutorApi& executor)
      : shared_(shared), executor_(executor) {}

  /// Returns when the robot moves, or with what came instead.
  Result<api::ExecutionResult> Begin(const api::ExecuteRequest& request) {
    const auto progress = std::make_shared<Progress>();
    {
      const std::lock_guard lock(mutex_);
      std::erase_if(motions_, [](const Motion& motion) { return motion.progress->Ended(); });
      motions_.push_back({progress, std::jthread([this, request, progress](std::stop_token stop) {
                            Run(request, *progress, std::move(stop));
                          })});
    }
    return progress->Wait();
  }

 private:
  class Progress {
   public:
    void Feed(const api::ExecutionFeedback& now) {
      if (now.state != "executing") return;
      api::ExecutionResult moving;
      moving.state = now.state;
      moving.plan.duration_s = now.duration_s;
      Tell(std::move(moving));
    }
    void End(Result<api::ExecutionResult> result) {
      Tell(std::move(result));
      ended_ = true;
    }
    bool Ended() const { return ended_; }
    Result<api::ExecutionResult> Wait() {
      std::unique_lock lock(mutex_);
      told_.wait(lock, [this] { return first_.has_value(); });
      return *first_;
    }

   private:
    void Tell(Result<api::ExecutionResult> result) {
      const std::lock_guard lock(mutex_);
      if (first_) return;
      first_ = std::move(result);
      told_.notify_all();
    }
    std::mutex mutex_;
    std::condition_variable told_;
    std::optional<Result<api::ExecutionResult>> first_;
    std::atomic<bool> ended_{false};
  };
  struct Motion {
    std::shared_ptr<Progress> progress;  // shared by the motion's thread and the waiting call
    std::jthread thread;
  };

  void Run(const api::ExecuteRequest& request, Progress& progress, std::stop_token stop) {
    std::stop_source ends;
    const std::stop_callback on_end(std::move(stop), [&] { ends.request_stop(); });
    const std::stop_callback on_shutdown(shared_.shutdown().get_token(),
                                         [&] { ends.request_stop(); });
    progress.End(executor_.Execute(
        request, [&](const api::ExecutionFeedback& now) { progress.Feed(now); }, ends.get_token()));
  }

  ServerShared& shared_;
  api::ExecutorApi& executor_;
  std::mutex mutex_;
  std::vector<Motion> motions_;
};

class ExecutorService final : public v1::ExecutorService::Service {
 public:
  ExecutorService(ServerShared& shared, api::ExecutorApi& executor)
      : shared_(shared), executor_(executor), detached_(shared, executor) {}

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
      if (request->detached()) return PutResult(detached_.Begin(*execution), writer);
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

 private:
  static Status PutResult(const Result<api::ExecutionResult>& result,
                          grpc::ServerWriter<v1::ExecuteResponse>* writer) {
    if (!result) return result.error();
    v1::ExecuteResponse last;
    ToProto(*result, last.mutable_result());
    writer->Write(last);
    return {};
  }

  ServerShared& shared_;
  api::ExecutorApi& executor_;
  DetachedMotions detached_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeExecutorService(ServerShared& shared,
                                                   api::ExecutorApi& executor) {
  return std::make_unique<ExecutorService>(shared, executor);
}

}  // namespace exemplar::rpc
