#include "relay.hpp"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/client_callback.h>

#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "exemplar/rpc/metadata.hpp"

namespace exemplar::rpc {
namespace {

/// What belongs to one connection, not to the call; and what only we may say.
bool StaysBehind(std::string_view name) {
  return name.starts_with(':') || name.starts_with("grpc-") || name == "user-agent" ||
         name == "content-type" || name == "te" || name == "host" || name == kForWhomKey;
}

std::string ToText(const grpc::string_ref& text) { return {text.data(), text.size()}; }

class Refused final : public RelayReactor {
 public:
  explicit Refused(const grpc::Status& status) { Finish(status); }
  void OnDone() override { delete this; }
};

class Relay final : public RelayReactor {
 public:
  Relay(grpc::CallbackServerContext& context, RelayOptions options)
      : context_(context), options_(std::move(options)), backend_(*this) {}

  void Start() {
    backend_context_ = grpc::ClientContext::FromCallbackServerContext(context_);
    for (const auto& [name, value] : context_.client_metadata()) {
      const std::string key = ToText(name);
      if (StaysBehind(key) || options_.metadata.count(key) != 0) continue;
      if (key == kAuthorizationKey && !options_.pass_authorization) continue;
      backend_context_->AddMetadata(key, ToText(value));
    }
    for (const auto& [name, value] : options_.metadata) backend_context_->AddMetadata(name, value);
    grpc::GenericStub(options_.connection->channel())
        .PrepareBidiStreamingCall(backend_context_.get(), options_.method, {}, &backend_);
    // One for each direction: the call at the backend's side lives until both have ended.
    backend_.AddMultipleHolds(2);
    backend_.StartCall();
    StartRead(&request_);
    // Last: it may cancel at once.
    on_stop_.emplace(options_.stop, [this] { backend_context_->TryCancel(); });
  }

  // From the caller.
  void OnReadDone(bool ok) override {
    const std::lock_guard lock(mutex_);
    if (requests_ended_) return;
    if (ok) {
      writing_ = true;
      backend_.StartWrite(&request_);
    } else {
      requests_ended_ = true;
      backend_.StartWritesDone();
      backend_.RemoveHold();
    }
  }
  void OnWriteDone(bool ok) override {
    if (ok) {
      backend_.StartRead(&answer_);
    } else {
      backend_context_->TryCancel();
      EndAnswers();
    }
  }
  void OnCancel() override { backend_context_->TryCancel(); }
  void OnDone() override { delete this; }

 private:
  class Backend final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
   public:
    explicit Backend(Relay& relay) : relay_(relay) {}
    void OnReadInitialMetadataDone(bool ok) override {
      if (ok) relay_.PassHeader();
      // Not before: the first answer takes the header along.
      StartRead(&relay_.answer_);
    }
    void OnReadDone(bool ok) override {
      if (ok) {
        relay_.StartWrite(&relay_.answer_);
      } else {
        relay_.EndAnswers();
      }
    }
    void OnWriteDone(bool ok) override { relay_.EndWrite(ok); }
    void OnDone(const grpc::Status& status) override { relay_.End(status); }

   private:
    Relay& relay_;
  };

  /// The answers' header goes out with the first of them, or with the end.
  void PassHeader() {
    for (const auto& [name, value] : backend_context_->GetServerInitialMetadata()) {
      const std::string key = ToText(name);
      if (!StaysBehind(key)) context_.AddInitialMetadata(key, ToText(value));
    }
  }

  void EndWrite(bool ok) {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if (requests_ended_) {
      backend_.RemoveHold();
    } else if (ok) {
      StartRead(&request_);
    } else {
      requests_ended_ = true;
      backend_.RemoveHold();
    }
  }

  /// The backend has nothing more to say, or nobody hears it: the requests end as well.
  void EndAnswers() {
    {
      const std::lock_guard lock(mutex_);
      if (!requests_ended_) {
        requests_ended_ = true;
        if (!writing_) backend_.RemoveHold();
      }
    }
    backend_.RemoveHold();
  }

  /// Both directions are done with: nothing is under way but a read from the caller, if any.
  void End(const grpc::Status& status) {
    for (const auto& [name, value] : backend_context_->GetServerTrailingMetadata()) {
      const std::string key = ToText(name);
      if (!StaysBehind(key)) context_.AddTrailingMetadata(key, ToText(value));
    }
    const grpc::Status translated = options_.translate(status);
    options_.on_done(translated);
    Finish(translated);
  }

  grpc::CallbackServerContext& context_;
  const RelayOptions options_;
  std::unique_ptr<grpc::ClientContext> backend_context_;
  Backend backend_;
  std::optional<std::stop_callback<std::function<void()>>> on_stop_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer answer_;

  std::mutex mutex_;  ///< guards the two below
  bool writing_ = false;
  bool requests_ended_ = false;
};

}  // namespace

RelayReactor* RefuseCall(const grpc::Status& status) { return new Refused(status); }

RelayReactor* StartRelay(grpc::CallbackServerContext& context, RelayOptions options) {
  auto* relay = new Relay(context, std::move(options));
  relay->Start();
  return relay;
}

}  // namespace exemplar::rpc
