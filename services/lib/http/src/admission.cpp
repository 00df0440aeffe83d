#include "admission.hpp"

#include <algorithm>
#include <iterator>

namespace exemplar::http {
namespace {

/// Addresses that are remembered; of those without a connection the oldest are forgotten.
constexpr std::size_t kMostPeers = 4096;

}  // namespace

bool Allowance::Take(Duration now) {
  left_ = std::min(per_second_, left_ + per_second_ * ToSeconds(now - as_of_));
  as_of_ = now;
  if (left_ < 1) return false;
  left_ -= 1;
  return true;
}

Admission::Admission(const Limits& limits, Duration now)
    : limits_(limits), rate_(limits.accepts_per_second, now) {}

Admission::Peer& Admission::Known(const std::string& peer, Duration now) {
  auto found = peers_.find(peer);
  if (found == peers_.end()) {
    for (auto oldest = ages_.end(); peers_.size() >= kMostPeers && oldest != ages_.begin();) {
      --oldest;
      const auto entry = peers_.find(*oldest);
      if (entry->second.connections > 0) continue;
      peers_.erase(entry);
      oldest = ages_.erase(oldest);
    }
    ages_.push_front(peer);
    found = peers_
                .emplace(peer, Peer{Allowance(limits_.accepts_per_second_per_peer, now), 0,
                                    ages_.begin()})
                .first;
  } else {
    ages_.splice(ages_.begin(), ages_, found->second.age);
  }
  return found->second;
}

bool Admission::Enter(const std::string& peer, Duration now) {
  Peer& known = Known(peer, now);
  // One that is refused for its own haste takes nothing from the others' allowance.
  if (!known.rate.Take(now) || known.connections >= limits_.connections_per_peer) return false;
  if (!rate_.Take(now) || connections_ >= limits_.connections) return false;
  ++known.connections;
  ++connections_;
  return true;
}

void Admission::Leave(const std::string& peer) {
  const auto found = peers_.find(peer);
  if (found == peers_.end() || found->second.connections == 0) return;
  --found->second.connections;
  --connections_;
}

}  // namespace exemplar::http
