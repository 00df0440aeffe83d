#pragma once
#include <cstddef>

#include "exemplar/base/stamp.hpp"

namespace exemplar::recorder {

/// Bytes a second over the last whole window of a second. Thread-compatible.
class ByteWindow {
 public:
  void Add(std::size_t bytes, Duration now) {
    Roll(now);
    bytes_ += static_cast<double>(bytes);
  }
  double PerSecond(Duration now) {
    Roll(now);
    return per_second_;
  }

 private:
  void Roll(Duration now) {
    const Duration age = now - begin_;
    if (age < std::chrono::seconds(1)) return;
    per_second_ = age < std::chrono::seconds(2) ? bytes_ / ToSeconds(age) : 0;
    bytes_ = 0;
    begin_ = now;
  }
  Duration begin_{0};
  double bytes_ = 0;
  double per_second_ = 0;
};

}  // namespace exemplar::recorder
