#include "gateway/foxglove/client_link.hpp"

#include <utility>

namespace exemplar::gateway::foxglove {
namespace {

constexpr std::size_t kMostSubscriptions = 1000;

}  // namespace

void ClientLink::SendBytes(std::string bytes) {
  socket_->Send({.binary = true, .head = std::move(bytes)});
}

void ClientLink::Say(StatusLevel level, const std::string& message, const std::string& id) {
  SendText(StatusText(level, message, id));
}

Status ClientLink::Subscribe(SubscribeOp::One subscription) {
  const std::lock_guard lock(mutex_);
  const std::string id = std::to_string(subscription.id);
  if (channel_of_.contains(subscription.id)) {
    return InvalidArgument("subscription id " + id + " is in use");
  }
  if (id_of_.contains(subscription.channel)) {
    return InvalidArgument("channel " + std::to_string(subscription.channel) +
                           " is subscribed already");
  }
  if (channel_of_.size() >= kMostSubscriptions) {
    return Error{ErrorCode::kResourceExhausted,
                 "no more than " + std::to_string(kMostSubscriptions) + " subscriptions"};
  }
  channel_of_[subscription.id] = subscription.channel;
  id_of_[subscription.channel] = subscription.id;
  return {};
}

Result<std::uint32_t> ClientLink::Unsubscribe(std::uint32_t id) {
  const std::lock_guard lock(mutex_);
  const auto found = channel_of_.find(id);
  if (found == channel_of_.end()) {
    return NotFound("there is no subscription of id " + std::to_string(id));
  }
  const std::uint32_t channel = found->second;
  channel_of_.erase(found);
  id_of_.erase(channel);
  return channel;
}

bool ClientLink::IsSubscribed(std::uint32_t channel) const {
  const std::lock_guard lock(mutex_);
  return id_of_.contains(channel);
}

void ClientLink::Forget(std::uint32_t channel) {
  const std::lock_guard lock(mutex_);
  const auto found = id_of_.find(channel);
  if (found == id_of_.end()) return;
  channel_of_.erase(found->second);
  id_of_.erase(found);
}

void ClientLink::Deliver(std::uint32_t channel, Stamp time, std::span<const std::byte> bytes,
                         std::shared_ptr<const void> owner) {
  const std::lock_guard lock(mutex_);
  const auto found = id_of_.find(channel);
  if (found == id_of_.end()) return;
  const http::WebSocket::Sent sent = socket_->Send({.binary = true,
                                                    .head = MessageHead(found->second, time),
                                                    .body = bytes,
                                                    .owner = std::move(owner),
                                                    .droppable = true,
                                                    .tag = channel});
  for (const std::uint64_t tag : sent.dropped) ++drops_[static_cast<std::uint32_t>(tag)];
}

std::map<std::uint32_t, std::uint64_t> ClientLink::TakeDrops() {
  const std::lock_guard lock(mutex_);
  return std::exchange(drops_, {});
}

}  // namespace exemplar::gateway::foxglove
