#pragma once
// When a robot is where on a path: how a speed profile becomes a motion of bounded jerk.

#include <span>
#include <vector>

namespace exemplar::motion {

/// Places on a path (ascending) and when they are passed.
struct PathClock {
  std::vector<double> time_s;
  std::vector<double> place;
};

/// From squared path speeds at places 0, step, 2 step, ...: the clock at even times, its path speed
/// averaged twice over a short window, so that the path acceleration changes steadily and begins
/// and ends at zero. Every place is passed, none is left out.
PathClock MakeClock(std::span<const double> squared_speeds, double step);

/// Takes `factor[i]` times the time at time i and smoothly less around; factors of 1 or less do
/// nothing.
void SlowDown(PathClock& clock, std::span<const double> factors);

/// When `place` is passed.
double TimeAt(const PathClock& clock, double place);

}  // namespace exemplar::motion
