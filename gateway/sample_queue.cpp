#include "gateway/sample_queue.hpp"

#include <algorithm>

namespace exemplar::gateway {
namespace {

/// Beyond it the times of writers, most of which have gone, are forgotten.
constexpr std::size_t kMostWriters = 4096;
/// What a sample costs beside its bytes.
constexpr std::size_t kOverhead = 200;

std::size_t CostOf(const ircp::RawSample& sample) { return sample.cdr.size() + kOverhead; }

}  // namespace

bool SampleQueue::IsDue(const ircp::RawSample& sample, Duration steady_now) {
  if (!(options_.max_rate_hz > 0)) return true;
  // Beyond the range of Duration there is one sample in a lifetime, as there is with this one.
  const Duration period = FromSeconds(std::min(1 / options_.max_rate_hz, 1e9));
  if (next_due_.size() > kMostWriters) next_due_.clear();
  const auto [entry, is_new] = next_due_.try_emplace(sample.writer, steady_now);
  if (!is_new && steady_now < entry->second) return false;
  entry->second = std::max(entry->second + period, steady_now);
  return true;
}

bool SampleQueue::Push(const SamplePtr& sample, Duration steady_now) {
  const std::lock_guard lock(mutex_);
  if (closed_ || !IsDue(*sample, steady_now)) return false;
  const bool was_empty = samples_.empty();
  samples_.push_back(sample);
  bytes_ += CostOf(*sample);
  while (samples_.size() > 1 &&
         (samples_.size() > options_.max_samples || bytes_ > options_.max_bytes)) {
    bytes_ -= CostOf(*samples_.front());
    samples_.pop_front();
    ++missed_;
  }
  if (!was_empty) return true;
  arrived_.notify_one();
  if (options_.on_ready) options_.on_ready();
  return true;
}

std::size_t SampleQueue::TakeLocked(std::vector<SamplePtr>& samples, std::size_t most) {
  const std::size_t count = std::min(most, samples_.size());
  for (std::size_t i = 0; i < count; ++i) {
    bytes_ -= CostOf(*samples_.front());
    samples.push_back(std::move(samples_.front()));
    samples_.pop_front();
  }
  return count;
}

std::size_t SampleQueue::Take(std::vector<SamplePtr>& samples, std::size_t most) {
  const std::lock_guard lock(mutex_);
  return TakeLocked(samples, most);
}

std::size_t SampleQueue::WaitAndTake(std::vector<SamplePtr>& samples, std::size_t most,
                                     const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  if (!arrived_.wait(lock, stop, [this] { return !samples_.empty(); })) return 0;
  return TakeLocked(samples, most);
}

std::uint64_t SampleQueue::missed() const {
  const std::lock_guard lock(mutex_);
  return missed_;
}

void SampleQueue::Close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  samples_.clear();
  bytes_ = 0;
}

}  // namespace exemplar::gateway
