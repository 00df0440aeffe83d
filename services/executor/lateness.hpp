#pragma once
// How late a periodic loop wakes: a histogram of fixed size.

#include <array>
#include <cstdint>

#include "exemplar/base/stamp.hpp"

namespace exemplar::executor {

/// Bins of 1 us growing by 2^(1/8), up to about a minute. Thread-compatible; does not allocate.
class LatenessHistogram {
 public:
  void Add(Duration lateness);
  /// The bin's upper edge below which the share `quantile` of all lies, at most 9 % too large.
  double QuantileSeconds(double quantile) const;
  double max_s() const { return max_s_; }
  std::uint64_t count() const { return count_; }

 private:
  static constexpr std::size_t kBins = 208;
  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  double max_s_ = 0;
};

}  // namespace exemplar::executor
