#include "exemplar/security/rate_limit.hpp"

#include <algorithm>

namespace exemplar::security {
namespace {

constexpr std::size_t kMostCallers = 4096;

}  // namespace

bool RateLimiter::Allow(const std::string& caller) {
  if (per_s_ <= 0) return true;
  const std::lock_guard lock(mutex_);
  const Duration now = clock_.Steady();
  auto found = buckets_.find(caller);
  if (found == buckets_.end()) {
    if (buckets_.size() >= kMostCallers) Forget(now);
    // More callers at once than any station has: somebody makes up names.
    if (buckets_.size() >= kMostCallers) return false;
    found = buckets_.emplace(caller, Bucket{burst(), now}).first;
  }
  Bucket& bucket = found->second;
  bucket.tokens = Fill(bucket, now);
  bucket.filled = now;
  if (bucket.tokens < 1) return false;
  bucket.tokens -= 1;
  return true;
}

double RateLimiter::Fill(const Bucket& bucket, Duration now) const {
  return std::min(burst(), bucket.tokens + per_s_ * ToSeconds(now - bucket.filled));
}

void RateLimiter::Forget(Duration now) {
  std::erase_if(buckets_,
                [&](const auto& entry) { return Fill(entry.second, now) >= burst() - 1e-9; });
}

}  // namespace exemplar::security
