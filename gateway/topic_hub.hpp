#pragma once
// A station's topics, read once for any number of clients. Everything that the gateway tells of
// topics (gRPC, HTTP, Foxglove) goes through here.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/api/topics.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/raw_writer.hpp"

namespace exemplar::gateway {

/// A sample is shared by all who subscribed to it.
using SamplePtr = std::shared_ptr<const ircp::RawSample>;

/// Whether `topic` is one of `patterns`, in which * stands for any text; true where there are none.
bool MatchesTopic(const std::string& topic, const std::vector<std::string>& patterns);

struct SubscriptionOptions {
  std::vector<std::string> topics = {};           ///< patterns as above
  double max_rate_hz = 0;                         ///< of each writer of a topic; 0: all
  std::size_t max_samples = 1000;                 ///< that wait to be taken
  std::size_t max_bytes = std::size_t{64} << 20;  ///< of them; one sample may always wait
  /// First the last sample of each writer whose topic is transient local.
  bool last = true;
  /// Called when there is something to take and was nothing before, on a thread of the network or
  /// within Subscribe: must be quick, and call neither the hub nor the subscription. Null: nobody.
  std::function<void()> on_ready = {};
};

/// Drops its oldest samples when they are not taken in time, and counts them. Its destructor ends
/// it: then on_ready is not called any more. Thread-safe.
class Subscription {
 public:
  virtual ~Subscription() = default;
  /// Appends up to `most` of the oldest samples to `samples`, without waiting; how many.
  virtual std::size_t Take(std::vector<SamplePtr>& samples, std::size_t most) = 0;
  /// As Take, but waits until there is one; 0 only when `stop` was requested.
  virtual std::size_t WaitAndTake(std::vector<SamplePtr>& samples, std::size_t most,
                                  std::stop_token stop) = 0;
  /// Dropped since the beginning.
  virtual std::uint64_t missed() const = 0;
};

struct TopicHubOptions {
  /// Topics that may be published on, as patterns; none: none. ircp/joint_command, ircp/clock and
  /// the programs' command and status topics never.
  std::vector<std::string> publish = {};
  /// Topics whose types are known though nobody may write them yet.
  std::vector<ircp::RawTopic> known = {};
  /// Reads the programs' statuses, which announce how much each has sent; null: what is lost at a
  /// writer's end is not counted.
  std::function<Result<ircp::StatusSample>(std::span<const std::uint8_t>)> decode_status = {};
  std::string source = "gateway";  ///< of published samples that name none
  /// More are refused.
  std::size_t max_subscriptions = 256;
  /// Writers that the gateway opens to publish, at most.
  std::size_t max_writers = 256;
};

/// Thread-safe; outlives its subscriptions.
class TopicHub {
 public:
  /// Reads all topics of the station from now on. All arguments outlive the hub.
  static Result<std::unique_ptr<TopicHub>> Create(ircp::RawBus& bus, ircp::RawOutlet& outlet,
                                                  const Clock& clock, TopicHubOptions options);
  virtual ~TopicHub() = default;

  /// Those that were discovered since the start, by name.
  virtual std::vector<api::TopicInfo> topics() const = 0;
  /// nullopt for one that was not discovered.
  virtual std::optional<api::TopicInfo> Find(const std::string& topic) const = 0;
  /// Changes whenever a topic was discovered or got its schema.
  virtual std::uint64_t revision() const = 0;
  /// `on_topic` hears of each topic once it is discovered and when its schema comes later, from now
  /// on, on a thread of the hub's; it may call the hub. The returned handle ends it.
  virtual std::shared_ptr<void> OnTopic(std::function<void(const api::TopicInfo&)> on_topic) = 0;

  /// Errors: kResourceExhausted when there are too many.
  virtual Result<std::unique_ptr<Subscription>> Subscribe(SubscriptionOptions options) = 0;

  /// `cdr` with its encapsulation header. `type` and `schema` may be empty for topics that were
  /// discovered. Errors: kFailedPrecondition where it may not; kInvalidArgument for bytes that are
  /// not of the type's schema.
  virtual Status Publish(const api::TopicPublication& publication) = 0;

  struct Figures {
    std::uint64_t received = 0;   ///< samples of all topics
    std::uint64_t delivered = 0;  ///< to subscriptions
    std::uint64_t missed = 0;     ///< by slow subscriptions
    std::uint64_t published = 0;
    std::uint64_t refused = 0;  ///< publications
    int subscriptions = 0;
  };
  virtual Figures figures() const = 0;
};

}  // namespace exemplar::gateway
