#include "exemplar/signal/resample.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

#include "exemplar/signal/statistics.hpp"

namespace exemplar::signal {

Place Locate(std::span<const double> times, double at) {
  assert(!times.empty());
  if (at <= times.front() || times.size() == 1) return {0, 0};
  if (at >= times.back()) return {times.size() - 2, 1};
  const auto after = std::upper_bound(times.begin(), times.end(), at);
  const auto index = static_cast<std::size_t>(after - times.begin()) - 1;
  return {index, (at - times[index]) / (times[index + 1] - times[index])};
}

Eigen::MatrixXd Interpolate(std::span<const double> times_s,
                            const Eigen::Ref<const Eigen::MatrixXd>& values,
                            std::span<const double> at_s) {
  assert(!times_s.empty() && static_cast<std::size_t>(values.rows()) == times_s.size());
  Eigen::MatrixXd out(static_cast<Eigen::Index>(at_s.size()), values.cols());
  for (std::size_t k = 0; k < at_s.size(); ++k) {
    const Place place = Locate(times_s, at_s[k]);
    const auto row = static_cast<Eigen::Index>(place.index);
    const auto to = static_cast<Eigen::Index>(k);
    if (place.part == 0) {
      out.row(to) = values.row(row);
    } else {
      out.row(to) = (1 - place.part) * values.row(row) + place.part * values.row(row + 1);
    }
  }
  return out;
}

std::vector<double> EvenTimes(double first_s, double last_s, int count) {
  assert(count >= 2);
  std::vector<double> times(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    times[static_cast<std::size_t>(k)] = first_s + (last_s - first_s) * k / (count - 1);
  }
  times.back() = last_s;
  return times;
}

double MedianInterval(std::span<const double> times_s) {
  if (times_s.size() < 2) return 0;
  std::vector<double> steps;
  steps.reserve(times_s.size() - 1);
  for (std::size_t k = 1; k < times_s.size(); ++k) steps.push_back(times_s[k] - times_s[k - 1]);
  return Quantile(std::move(steps), 0.5);
}

std::vector<Gap> FindGaps(std::span<const double> times_s, double limit_s) {
  std::vector<Gap> gaps;
  for (std::size_t k = 1; k < times_s.size(); ++k) {
    if (times_s[k] - times_s[k - 1] > limit_s) gaps.push_back({times_s[k - 1], times_s[k]});
  }
  return gaps;
}

std::vector<std::size_t> FindNews(std::span<const double> times_s,
                                  const Eigen::Ref<const Eigen::MatrixXd>& values) {
  constexpr double kLeastPart = 0.2;
  constexpr double kStillness = 4;
  constexpr double kLongestHold_s = 0.25;
  assert(static_cast<std::size_t>(values.rows()) == times_s.size());
  const std::size_t n = times_s.size();
  std::vector<std::size_t> news;
  for (std::size_t k = 0; k < n; ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    if (k == 0 || values.row(row) != values.row(row - 1)) news.push_back(k);
  }
  const bool held = static_cast<double>(n - news.size()) >= kLeastPart * static_cast<double>(n);
  std::vector<std::size_t> kept;
  if (!held || news.size() < 3) {
    kept.resize(n);
    std::iota(kept.begin(), kept.end(), std::size_t{0});
    return kept;
  }
  std::vector<double> intervals;
  for (std::size_t i = 1; i < news.size(); ++i) {
    intervals.push_back(times_s[news[i]] - times_s[news[i - 1]]);
  }
  const double longest_s =
      std::min(kStillness * Quantile(std::move(intervals), 0.5), kLongestHold_s);
  for (std::size_t i = 0; i < news.size(); ++i) {
    kept.push_back(news[i]);
    const std::size_t last = (i + 1 < news.size() ? news[i + 1] : n) - 1;
    const bool end = i + 1 == news.size();
    if (last > news[i] && (end || times_s[last] - times_s[news[i]] > longest_s)) {
      kept.push_back(last);
    }
  }
  return kept;
}

}  // namespace exemplar::signal
