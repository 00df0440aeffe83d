#pragma once
// Motions that the learner's tests generate.

#include <algorithm>
#include <cmath>

#include "exemplar/learning/aligned.hpp"

namespace exemplar::learning {

/// From 0 to 1 while s goes from 0 to 1 (Flash & Hogan 1985).
inline double MinimumJerk(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10 - 15 * s + 6 * s * s);
}

/// A trial without streams on an even time base.
inline UniformTrial EvenTrial(double duration_s, double rate_hz) {
  UniformTrial trial;
  const int n = static_cast<int>(std::lround(duration_s * rate_hz)) + 1;
  for (int k = 0; k < n; ++k) trial.time_s.push_back(duration_s * k / (n - 1));
  trial.joints.resize(n, 0);
  return trial;
}

}  // namespace exemplar::learning
