#pragma once
#include <atomic>
#include <memory>
#include <string>

#include "exemplar/api/topics.hpp"
#include "gateway/topic_hub.hpp"

namespace exemplar::gateway {

struct TopicServerOptions {
  /// Each holds a thread of the caller's; more are refused.
  int subscriptions = 256;
  /// What may wait for one client, and what a client may ask for at most.
  int queue = 10000;
  std::size_t queue_bytes = std::size_t{64} << 20;
  /// Samples of one batch.
  std::size_t batch = 256;
  std::size_t batch_bytes = std::size_t{1} << 20;  ///< one sample may always go
};

/// The hub as clients of gRPC and HTTP see it. Thread-safe.
class TopicServer final : public api::TopicApi {
 public:
  /// The hub outlives it.
  TopicServer(TopicHub& hub, TopicServerOptions options) : hub_(hub), options_(options) {}

  Result<std::vector<api::TopicInfo>> List(const std::vector<std::string>& topics) override;
  Status Subscribe(const api::TopicSubscription& subscription,
                   const std::function<bool(const api::TopicBatch&)>& on_batch,
                   std::stop_token stop) override;
  Status Publish(const api::TopicPublication& publication) override;

 private:
  TopicHub& hub_;
  const TopicServerOptions options_;
  std::atomic<int> subscriptions_{0};
};

}  // namespace exemplar::gateway
