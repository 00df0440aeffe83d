#pragma once
// What the bridge's sessions share.

#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "gateway/foxglove/bridge.hpp"
#include "gateway/foxglove/catalogue.hpp"
#include "gateway/foxglove/client_link.hpp"
#include "gateway/foxglove/workers.hpp"

namespace exemplar::gateway::foxglove {

/// One client's subscription to one topic of the hub.
struct Feed {
  std::weak_ptr<ClientLink> link;
  std::uint32_t channel = 0;
  std::mutex mutex;  ///< of what follows
  std::unique_ptr<Subscription> subscription;
};

/// A message that who subscribes later gets at once.
struct Kept {
  Stamp time;
  std::shared_ptr<const std::string> bytes;
};

struct BridgeCore {
  BridgeCore(TopicHub& the_hub, const Clock& the_clock, Log& the_log,
             std::vector<Service> the_services, BridgeOptions the_options)
      : hub(the_hub),
        clock(the_clock),
        log(the_log),
        services(std::move(the_services)),
        options(std::move(the_options)) {}

  TopicHub& hub;
  const Clock& clock;
  Log& log;
  const std::vector<Service> services;
  const BridgeOptions options;

  std::atomic<std::uint64_t> clients{0};
  std::atomic<std::uint64_t> dropped{0};
  std::atomic<std::uint64_t> bad_messages{0};
  std::atomic<std::uint64_t> calls{0};
  std::atomic<std::uint64_t> failed_calls{0};
  std::atomic<std::uint64_t> published{0};
  std::atomic<std::uint64_t> refused{0};
  std::atomic<std::uint64_t> refused_clients{0};

  std::mutex mutex;  ///< of the next three
  Catalogue catalogue;
  std::map<std::uint32_t, Kept> kept;
  std::vector<std::weak_ptr<ClientLink>> links;

  std::mutex ready_mutex;  ///< of the next one; taken last
  std::deque<std::weak_ptr<Feed>> ready;
  std::condition_variable_any ready_there;

  Workers callers{options.calls, 64};
  Workers publisher{1, 1024};
};

/// Marks a feed as having something to take.
void MarkReady(BridgeCore& core, std::weak_ptr<Feed> feed);

/// A client's session. The core outlives it.
std::unique_ptr<http::WebSocketSession> OpenLiveSession(BridgeCore& core,
                                                        std::shared_ptr<http::WebSocket> socket,
                                                        Permission permission);

}  // namespace exemplar::gateway::foxglove
