#pragma once
// The station's topics, services and scene for Foxglove and Lichtblick.

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/metric.hpp"
#include "exemplar/http/server.hpp"
#include "gateway/foxglove/protocol.hpp"
#include "gateway/topic_hub.hpp"

namespace exemplar::gateway::foxglove {

/// Something that clients may have done. `call` runs on a thread of the bridge's and may take long;
/// JSON in, JSON out. `origin` is what the client's connection began with.
struct Service {
  ServiceInfo info;
  std::function<Result<std::string>(std::string_view request, const http::Request& origin,
                                    std::stop_token stop)>
      call;
};

/// What a connection may do beside calling services, which are judged call by call.
struct Permission {
  bool observe = true;
  bool publish = true;  ///< where the hub lets anybody
};

/// Judges the request that a connection begins with; quick. Null: all may all.
using Permit = std::function<Permission(const http::Request&)>;

struct BridgeOptions {
  std::string name = "exemplar";
  std::string session;          ///< tells clients a restarted server from a broken connection
  bool simulated_time = false;  ///< tell clients the clock's time, which then is not theirs
  std::size_t calls = 8;        ///< of services at once
  http::WebSocketEndpoint endpoint = {};  ///< bounds; `subprotocols` and `open` are the bridge's
  Permit permit = {};
};

/// A slow client misses messages, which are counted and told to it; it slows nobody. Thread-safe.
/// The HTTP server that has the endpoint stops before the bridge goes.
class Bridge {
 public:
  /// Hub, clock and log outlive the bridge.
  static std::unique_ptr<Bridge> Create(TopicHub& hub, const Clock& clock, Log& log,
                                        std::vector<Service> services, BridgeOptions options);
  virtual ~Bridge() = default;

  virtual http::WebSocketEndpoint Endpoint() = 0;

  /// A channel of the bridge's own; the id is filled in and returned.
  virtual std::uint32_t AddChannel(ChannelInfo channel) = 0;
  /// `keep`: who subscribes later gets it at once.
  virtual void Publish(std::uint32_t channel, Stamp time, std::string bytes, bool keep) = 0;

  struct Figures {
    std::uint64_t clients = 0;       ///< now
    std::uint64_t dropped = 0;       ///< messages, for slow clients
    std::uint64_t bad_messages = 0;  ///< that are not of the protocol, or of unknown ids
    std::uint64_t calls = 0;
    std::uint64_t failed_calls = 0;
    std::uint64_t published = 0;  ///< by clients
    std::uint64_t refused = 0;    ///< likewise
    std::uint64_t refused_clients = 0;
  };
  virtual Figures figures() const = 0;
};

std::vector<Metric> MetricsOf(const Bridge& bridge);

}  // namespace exemplar::gateway::foxglove
