#include "path_clock.hpp"

#include <algorithm>
#include <cmath>

namespace exemplar::motion {
namespace {

constexpr double kClockStep_s = 0.008;
constexpr double kSmallestClockStep_s = 0.001;
constexpr int kFewestSteps = 24;
constexpr int kMostSteps = 6000;
/// Each of the two windows over which the path speed is averaged.
constexpr double kWindow_s = 0.064;
/// How far a slow stretch reaches to either side of where it is needed.
constexpr double kSlowReach_s = 0.16;
/// A step between two neighbouring stops takes as long as at this path acceleration.
constexpr double kStopToStopAcceleration = 8;

int OddWidth(double window_s, double step_s) {
  return 2 * std::max(1, static_cast<int>(std::lround(0.5 * window_s / step_s))) + 1;
}

/// Running means over `width` values, the ends held: width - 1 values longer.
std::vector<double> Average(const std::vector<double>& values, int width) {
  const int size = static_cast<int>(values.size());
  const auto at = [&](int i) {
    return values[static_cast<std::size_t>(std::clamp(i, 0, size - 1))];
  };
  std::vector<double> out(static_cast<std::size_t>(size + width - 1));
  double sum = width * values.front();
  for (int i = 0; i < size + width - 1; ++i) {
    sum += at(i) - at(i - width);
    out[static_cast<std::size_t>(i)] = sum / width;
  }
  out.front() = values.front();
  out.back() = values.back();
  for (std::size_t i = 1; i < out.size(); ++i) {
    out[i] = std::clamp(out[i], out[i - 1], values.back());
  }
  return out;
}

}  // namespace

PathClock MakeClock(std::span<const double> squared_speeds, double step) {
  const std::size_t points = squared_speeds.size();
  std::vector<double> passed(points, 0.0);
  for (std::size_t i = 1; i < points; ++i) {
    const double mean = 0.5 * (std::sqrt(squared_speeds[i - 1]) + std::sqrt(squared_speeds[i]));
    passed[i] =
        passed[i - 1] + (mean > 1e-9 ? step / mean : 2 * std::sqrt(step / kStopToStopAcceleration));
  }
  const double duration = passed.back();
  const double even =
      std::max(std::clamp(duration / kFewestSteps, kSmallestClockStep_s, kClockStep_s),
               duration / kMostSteps);
  const int steps = std::max(1, static_cast<int>(std::ceil(duration / even)));
  std::vector<double> place;
  std::size_t i = 0;
  for (int k = 0; k <= steps; ++k) {
    const double t = duration * k / steps;
    while (i + 2 < points && passed[i + 1] < t) ++i;
    const double within = std::clamp(t - passed[i], 0.0, passed[i + 1] - passed[i]);
    const double speed = std::sqrt(squared_speeds[i]);
    const double whole = passed[i + 1] - passed[i];
    const double gain = (std::sqrt(squared_speeds[i + 1]) - speed) / whole;
    const double way = speed + gain * whole > 1e-9 || speed > 1e-9
                           ? within * (speed + 0.5 * gain * within)
                           : step * within / whole;
    place.push_back(step * static_cast<double>(i) + way);
  }
  place.back() = step * static_cast<double>(points - 1);
  const double dt = duration / steps;
  const int width = OddWidth(kWindow_s, dt);
  PathClock clock;
  clock.place = Average(Average(place, width), width);
  for (std::size_t k = 0; k < clock.place.size(); ++k) {
    clock.time_s.push_back(dt * static_cast<double>(k));
  }
  return clock;
}

void SlowDown(PathClock& clock, std::span<const double> factors) {
  const int size = static_cast<int>(factors.size());
  const double mean_step = clock.time_s.back() / (size - 1);
  const int reach = OddWidth(kSlowReach_s, mean_step);
  std::vector<double> widened(factors.size(), 1.0);
  for (int i = 0; i < size; ++i) {
    if (factors[static_cast<std::size_t>(i)] <= 1) continue;
    for (int k = std::max(0, i - reach); k <= std::min(size - 1, i + reach); ++k) {
      double& value = widened[static_cast<std::size_t>(k)];
      value = std::max(value, factors[static_cast<std::size_t>(i)]);
    }
  }
  // Two means over `reach` values in all stay within what was widened.
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<double> mean(widened.size());
    const int half = reach / 2;
    double sum = 0;
    const auto at = [&](int i) {
      return widened[static_cast<std::size_t>(std::clamp(i, 0, size - 1))];
    };
    for (int k = -half; k <= half; ++k) sum += at(k);
    for (int i = 0; i < size; ++i) {
      mean[static_cast<std::size_t>(i)] = sum / (2 * half + 1);
      sum += at(i + half + 1) - at(i - half);
    }
    widened.swap(mean);
  }
  double before = clock.time_s.front();
  for (std::size_t i = 1; i < clock.time_s.size(); ++i) {
    const double step = clock.time_s[i] - before;
    before = clock.time_s[i];
    clock.time_s[i] = clock.time_s[i - 1] + step * 0.5 * (widened[i - 1] + widened[i]);
  }
}

double TimeAt(const PathClock& clock, double place) {
  const auto after = std::upper_bound(clock.place.begin() + 1, clock.place.end() - 1, place);
  const auto i = static_cast<std::size_t>(after - clock.place.begin()) - 1;
  const double step = clock.place[i + 1] - clock.place[i];
  const double part = step > 0 ? std::clamp((place - clock.place[i]) / step, 0.0, 1.0) : 1.0;
  return clock.time_s[i] + part * (clock.time_s[i + 1] - clock.time_s[i]);
}

}  // namespace exemplar::motion
