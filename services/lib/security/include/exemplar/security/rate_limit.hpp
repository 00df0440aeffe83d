#pragma once
// How often each caller may call.

#include <map>
#include <mutex>
#include <string>

#include "exemplar/base/clock.hpp"

namespace exemplar::security {

/// A token bucket for each caller: `per_s` calls in the mean, bursts of up to twice that. Keeps at
/// most a few thousand callers: those that have been quiet are forgotten, which changes nothing for
/// them. Thread-safe.
class RateLimiter {
 public:
  /// `per_s` zero: no limit. The clock outlives the limiter.
  RateLimiter(double per_s, const Clock& clock) : per_s_(per_s), clock_(clock) {}
  /// False: this call is one too many.
  bool Allow(const std::string& caller);

 private:
  struct Bucket {
    double tokens = 0;
    Duration filled{0};
  };
  double burst() const { return per_s_ < 0.5 ? 1 : 2 * per_s_; }
  double Fill(const Bucket& bucket, Duration now) const;
  void Forget(Duration now);

  const double per_s_;
  const Clock& clock_;
  std::mutex mutex_;
  std::map<std::string, Bucket> buckets_;
};

}  // namespace exemplar::security
