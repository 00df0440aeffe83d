#pragma once
// One Foxglove client: its subscriptions, what it is sent, what it missed.

#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>

#include "exemplar/http/server.hpp"
#include "gateway/foxglove/protocol.hpp"

namespace exemplar::gateway::foxglove {

/// Thread-safe.
class ClientLink {
 public:
  explicit ClientLink(std::shared_ptr<http::WebSocket> socket) : socket_(std::move(socket)) {}

  void SendText(std::string text) { socket_->SendText(std::move(text)); }
  void SendBytes(std::string bytes);
  void Say(StatusLevel level, const std::string& message, const std::string& id = {});

  /// Errors are sentences for the client.
  Status Subscribe(SubscribeOp::One subscription);
  /// The channel that it was of.
  Result<std::uint32_t> Unsubscribe(std::uint32_t id);
  bool IsSubscribed(std::uint32_t channel) const;
  /// Ends the subscription to a channel that goes.
  void Forget(std::uint32_t channel);

  /// Queues one message, if the client is subscribed; `owner` keeps `bytes`.
  void Deliver(std::uint32_t channel, Stamp time, std::span<const std::byte> bytes,
               std::shared_ptr<const void> owner);
  /// Messages that were dropped since the last call, by channel.
  std::map<std::uint32_t, std::uint64_t> TakeDrops();

  http::WebSocket& socket() const { return *socket_; }

 private:
  const std::shared_ptr<http::WebSocket> socket_;
  mutable std::mutex mutex_;
  std::map<std::uint32_t, std::uint32_t> channel_of_;  ///< by subscription id
  std::map<std::uint32_t, std::uint32_t> id_of_;       ///< by channel
  std::map<std::uint32_t, std::uint64_t> drops_;
};

}  // namespace exemplar::gateway::foxglove
