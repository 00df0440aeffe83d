#pragma once
// The half of a WebSocket that its senders hold; it may outlive the connection and the server.

#include <functional>
#include <mutex>

#include "core.hpp"
#include "frame_queue.hpp"

namespace exemplar::http {

class WebSocketHandle final : public WebSocket {
 public:
  /// `wake` makes the network thread send what waits; called on any thread.
  WebSocketHandle(std::uint64_t id, Upgrade upgrade, const WebSocketEndpoint& endpoint,
                  Counters& counters, std::function<void()> wake);

  Sent Send(Frame frame) override;
  void Close(int code, std::string reason) override;
  std::uint64_t id() const override { return id_; }
  const std::string& subprotocol() const override { return upgrade_.subprotocol; }
  const Request& request() const override { return upgrade_.request; }
  std::size_t queued_bytes() const override;
  std::uint64_t dropped() const override { return dropped_; }
  std::uint64_t sent() const override { return sent_; }

  // For the connection, on the network thread.

  /// The next frame to send; nullopt when none waits: then `wake` is called for the next one.
  std::optional<Frame> Next();
  void CountSent() { ++sent_; }
  struct Closing {
    int code;
    std::string reason;
  };
  std::optional<Closing> closing() const;
  /// The connection has gone: nothing is queued and nobody is woken any more.
  void Abandon();

 private:
  void CloseLocked(int code, std::string reason);

  const std::uint64_t id_;
  const Upgrade upgrade_;
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint64_t> sent_{0};

  mutable std::mutex mutex_;
  FrameQueue queue_;
  Counters* counters_;  ///< null once abandoned
  std::function<void()> wake_;
  bool awake_ = false;  ///< the network thread is at it
  std::optional<Closing> closing_;
};

}  // namespace exemplar::http
