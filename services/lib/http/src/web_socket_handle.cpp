#include "web_socket_handle.hpp"

#include <utility>

namespace exemplar::http {
namespace {

constexpr int kPolicyViolation = 1008;

}  // namespace

WebSocketHandle::WebSocketHandle(std::uint64_t id, Upgrade upgrade,
                                 const WebSocketEndpoint& endpoint, Counters& counters,
                                 std::function<void()> wake)
    : id_(id),
      upgrade_(std::move(upgrade)),
      queue_({endpoint.queue_bytes, endpoint.queue_frames, endpoint.firm_bytes}),
      counters_(&counters),
      wake_(std::move(wake)) {}

WebSocket::Sent WebSocketHandle::Send(Frame frame) {
  const std::lock_guard lock(mutex_);
  if (counters_ == nullptr || closing_) return {.open = false};
  auto dropped = queue_.Push(std::move(frame));
  if (!dropped) {
    CloseLocked(kPolicyViolation, "too far behind");
    return {.open = false};
  }
  dropped_ += dropped->size();
  counters_->frames_dropped += dropped->size();
  if (!awake_) {
    awake_ = true;
    wake_();
  }
  return {.open = true, .dropped = std::move(*dropped)};
}

void WebSocketHandle::Close(int code, std::string reason) {
  const std::lock_guard lock(mutex_);
  if (counters_ != nullptr && !closing_) CloseLocked(code, std::move(reason));
}

void WebSocketHandle::CloseLocked(int code, std::string reason) {
  constexpr std::size_t kLongestReason = 120;
  queue_.KeepFirm();
  closing_ = {code, reason.substr(0, kLongestReason)};
  if (awake_) return;
  awake_ = true;
  wake_();
}

std::size_t WebSocketHandle::queued_bytes() const {
  const std::lock_guard lock(mutex_);
  return queue_.bytes();
}

std::optional<Frame> WebSocketHandle::Next() {
  const std::lock_guard lock(mutex_);
  std::optional<Frame> frame = queue_.Pop();
  if (!frame) awake_ = false;
  return frame;
}

std::optional<WebSocketHandle::Closing> WebSocketHandle::closing() const {
  const std::lock_guard lock(mutex_);
  return closing_;
}

void WebSocketHandle::Abandon() {
  const std::lock_guard lock(mutex_);
  counters_ = nullptr;
  wake_ = nullptr;
  while (queue_.Pop()) {
  }
}

}  // namespace exemplar::http
