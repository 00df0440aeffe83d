#include "exemplar/learning/touch.hpp"

#include <algorithm>

#include "exemplar/signal/statistics.hpp"

namespace exemplar::learning {

std::vector<Touch> FindTouches(const Eigen::Ref<const Eigen::VectorXd>& touch_n) {
  constexpr double kLeastForce_n = 0.2;  // the paper's sensors start below 1 N
  constexpr double kPartOfPeak = 0.1;
  constexpr double kNoiseDeviations = 6;
  const auto n = static_cast<int>(touch_n.size());
  if (n == 0) return {};
  const double peak = touch_n.maxCoeff();
  const double rest = signal::Quantile(touch_n, 0.1);
  const double noise = signal::NoiseDeviation(touch_n);
  const double on =
      rest + std::max({kLeastForce_n, kPartOfPeak * (peak - rest), kNoiseDeviations * noise});
  const double off = rest + (on - rest) / 2;
  std::vector<Touch> touches;
  for (int k = 0; k < n; ++k) {
    if (touch_n[k] < on) continue;
    Touch touch;
    touch.first = k;
    while (touch.first > 0 && touch_n[touch.first - 1] > off) --touch.first;
    while (k + 1 < n && touch_n[k + 1] > off) ++k;
    touch.last = k;
    touch.peak_n = touch_n.segment(touch.first, touch.last - touch.first + 1).maxCoeff();
    touch.begins = touch.first > 0;
    touch.ends = touch.last < n - 1;
    touches.push_back(touch);
  }
  return touches;
}

}  // namespace exemplar::learning
