#include "health_watch.hpp"

#include <grpcpp/alarm.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/client_callback.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <utility>
#include <vector>

namespace exemplar::rpc {
namespace {

constexpr auto kRetry = std::chrono::milliseconds(500);

/// grpc.health.v1.HealthCheckResponse: field 1, a number; 1 is SERVING.
bool SaysServing(const grpc::ByteBuffer& answer) {
  std::vector<grpc::Slice> slices;
  if (!answer.Dump(&slices).ok()) return false;
  std::string bytes;
  for (const grpc::Slice& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return bytes == std::string("\x08\x01");
}

}  // namespace

struct HealthWatch::State {
  std::shared_ptr<Connection> connection;
  std::function<void(bool)> on_change;

  std::mutex mutex;  ///< guards the rest; held during on_change
  std::condition_variable idle;
  bool stopped = false;
  bool asking = false;
  grpc::ClientContext* context = nullptr;
  grpc::Alarm retry;

  void Tell(bool serving) {
    const std::lock_guard lock(mutex);
    if (!stopped) on_change(serving);
  }
};

/// One Watch call; deletes itself.
class HealthWatch::Call final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  explicit Call(std::shared_ptr<State> state) : state_(std::move(state)) {
    // Until the server is there, however long that takes; the channel tries on its own.
    context_.set_wait_for_ready(true);
    grpc::GenericStub(state_->connection->channel())
        .PrepareBidiStreamingCall(&context_, "/grpc.health.v1.Health/Watch", {}, this);
  }
  grpc::ClientContext& context() { return context_; }

  void Start() {
    StartWriteLast(&request_, grpc::WriteOptions());
    StartRead(&answer_);
    StartCall();
  }
  void OnReadDone(bool ok) override {
    if (!ok) return;
    const bool serving = SaysServing(answer_);
    state_->Tell(serving);
    // A server that goes waits for its last call: not for this one.
    if (served_ && !serving) context_.TryCancel();
    served_ = serving;
    StartRead(&answer_);
  }
  void OnDone(const grpc::Status& status) override {
    // A server without a health service is well when it answers.
    state_->Tell(status.error_code() == grpc::StatusCode::UNIMPLEMENTED);
    const std::shared_ptr<State> state = std::move(state_);
    {
      const std::lock_guard lock(state->mutex);
      state->context = nullptr;
      if (state->stopped) {
        state->asking = false;
        state->idle.notify_all();
      } else {
        state->retry.Set(std::chrono::system_clock::now() + kRetry, [state](bool) { Ask(state); });
      }
    }
    delete this;
  }

 private:
  std::shared_ptr<State> state_;
  grpc::ClientContext context_;
  grpc::ByteBuffer request_{nullptr, 0};  ///< of the server as a whole
  grpc::ByteBuffer answer_;
  bool served_ = false;
};

HealthWatch::HealthWatch(std::shared_ptr<Connection> connection,
                         std::function<void(bool serving)> on_change)
    : state_(std::make_shared<State>()) {
  state_->connection = std::move(connection);
  state_->on_change = std::move(on_change);
  state_->asking = true;
  Ask(state_);
}

void HealthWatch::Ask(const std::shared_ptr<State>& state) {
  auto* call = new Call(state);
  {
    const std::lock_guard lock(state->mutex);
    if (state->stopped) call->context().TryCancel();
    state->context = &call->context();
  }
  call->Start();
}

HealthWatch::~HealthWatch() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->stopped = true;
    if (state_->context != nullptr) state_->context->TryCancel();
  }
  state_->retry.Cancel();
  std::unique_lock lock(state_->mutex);
  state_->idle.wait(lock, [this] { return !state_->asking; });
}

}  // namespace exemplar::rpc
