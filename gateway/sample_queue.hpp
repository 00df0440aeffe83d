#pragma once
#include <condition_variable>
#include <deque>
#include <mutex>
#include <unordered_map>

#include "gateway/topic_hub.hpp"

namespace exemplar::gateway {

/// What waits for one client: bounded by samples and by bytes, the oldest gives way. Thread-safe.
class SampleQueue {
 public:
  explicit SampleQueue(SubscriptionOptions options) : options_(std::move(options)) {}

  /// False: left out for the rate.
  bool Push(const SamplePtr& sample, Duration steady_now);
  std::size_t Take(std::vector<SamplePtr>& samples, std::size_t most);
  std::size_t WaitAndTake(std::vector<SamplePtr>& samples, std::size_t most,
                          const std::stop_token& stop);
  std::uint64_t missed() const;
  /// From now on nobody is told any more.
  void Close();

  const SubscriptionOptions& options() const { return options_; }

 private:
  bool IsDue(const ircp::RawSample& sample, Duration steady_now);
  std::size_t TakeLocked(std::vector<SamplePtr>& samples, std::size_t most);

  const SubscriptionOptions options_;
  mutable std::mutex mutex_;  ///< guards the rest
  std::condition_variable_any arrived_;
  std::deque<SamplePtr> samples_;
  std::size_t bytes_ = 0;
  std::uint64_t missed_ = 0;
  bool closed_ = false;
  std::unordered_map<std::string, Duration> next_due_;  ///< by writer, where the rate is limited
};

}  // namespace exemplar::gateway
