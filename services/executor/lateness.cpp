#include "executor/lateness.hpp"

#include <algorithm>
#include <cmath>

namespace exemplar::executor {

namespace {
constexpr double kFirstEdge_s = 1e-6;
constexpr double kBinsPerOctave = 8;
}  // namespace

void LatenessHistogram::Add(Duration lateness) {
  const double seconds = std::max(0.0, ToSeconds(lateness));
  max_s_ = std::max(max_s_, seconds);
  ++count_;
  std::size_t bin = 0;
  if (seconds > kFirstEdge_s) {
    const double exact = std::ceil(kBinsPerOctave * std::log2(seconds / kFirstEdge_s));
    bin = std::min(kBins - 1, static_cast<std::size_t>(exact));
  }
  ++bins_[bin];
}

double LatenessHistogram::QuantileSeconds(double quantile) const {
  const double wanted = quantile * static_cast<double>(count_);
  std::uint64_t below = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    below += bins_[bin];
    if (below > 0 && static_cast<double>(below) >= wanted) {
      return std::min(max_s_, kFirstEdge_s * std::exp2(static_cast<double>(bin) / kBinsPerOctave));
    }
  }
  return max_s_;
}

}  // namespace exemplar::executor
