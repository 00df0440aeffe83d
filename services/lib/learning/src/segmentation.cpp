#include "exemplar/learning/segmentation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "exemplar/learning/touch.hpp"
#include "exemplar/signal/derivative.hpp"
#include "exemplar/signal/statistics.hpp"

namespace exemplar::learning {
namespace {

double Step(const UniformTrial& trial) {
  return trial.time_s.size() < 2 ? 1
                                 : (trial.time_s.back() - trial.time_s.front()) /
                                       static_cast<double>(trial.time_s.size() - 1);
}

Eigen::VectorXd ToolMsv(const UniformTrial& trial) {
  const auto n = static_cast<Eigen::Index>(trial.base_T_tool.size());
  const double step_s = Step(trial);
  Eigen::MatrixXd position(n, 3);
  for (Eigen::Index k = 0; k < n; ++k) {
    position.row(k) = trial.base_T_tool[static_cast<std::size_t>(k)].translation;
  }
  Eigen::VectorXd msv = signal::Derivative(position, step_s).rowwise().squaredNorm();
  if (!trial.has_orientation || n < 2) return msv;
  const double radius_squared =
      (position.rowwise() - position.colwise().mean()).rowwise().squaredNorm().mean();
  const double length_squared = radius_squared / (std::numbers::pi * std::numbers::pi);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Index before = std::max<Eigen::Index>(0, k - 1);
    const Eigen::Index after = std::min<Eigen::Index>(n - 1, k + 1);
    const double angle =
        geometry::AngleBetween(trial.base_T_tool[static_cast<std::size_t>(before)].rotation,
                               trial.base_T_tool[static_cast<std::size_t>(after)].rotation);
    const double speed = angle / (static_cast<double>(after - before) * step_s);
    msv[k] += length_squared * speed * speed;
  }
  return msv;
}

std::vector<Marker> TouchMarkers(const std::vector<Touch>& touches, const UniformTrial& trial) {
  std::vector<Marker> markers;
  double largest = 0;
  for (const Touch& touch : touches) largest = std::max(largest, touch.peak_n);
  const auto add = [&](int frame, MarkerKind kind, const char* cause, const Touch& touch) {
    markers.push_back({trial.time_s[static_cast<std::size_t>(frame)], frame, kind, cause,
                       1 + touch.peak_n / largest});
  };
  for (const Touch& touch : touches) {
    if (touch.begins) add(touch.first, MarkerKind::kBeginning, "touch onset", touch);
    if (touch.ends) {
      add(touch.last, MarkerKind::kEnding, "touch release", touch);
      add(touch.last, MarkerKind::kBeginning, "touch release", touch);
    }
  }
  return markers;
}

}  // namespace

Eigen::VectorXd MeanSquaredVelocity(const UniformTrial& trial) {
  if (trial.joints.cols() == 0) return ToolMsv(trial);
  return signal::Derivative(trial.joints, Step(trial)).rowwise().squaredNorm();
}

Thresholds FindThresholds(const Eigen::Ref<const Eigen::VectorXd>& msv) {
  if (msv.size() == 0) return {};
  const double mean = msv.mean();
  const double sigma = signal::Deviation(msv);
  const double high = mean + sigma / 2;
  Thresholds thresholds;
  thresholds.c = mean - sigma / 2;
  if (thresholds.c <= 0 && high > 0) {
    thresholds.c_replaced = true;
    thresholds.c = std::clamp(3 * signal::Median(msv), 0.01 * high, 0.25 * high);
  }
  thresholds.k = thresholds.c > 0 ? high / thresholds.c : 1;
  return thresholds;
}

std::vector<Boundary> FindBeginnings(const Eigen::Ref<const Eigen::VectorXd>& msv,
                                     const Thresholds& thresholds, EpisodeRule rule) {
  const auto n = static_cast<int>(msv.size());
  const double c = thresholds.c;
  const double high = thresholds.high();
  std::vector<Boundary> found;
  if (!(c > 0)) return found;
  // Backwards, so that the peak of what follows is at hand: until the fall below c, or to the end.
  double peak = 0;
  for (int t = n - 1; t >= 0; --t) {
    if (rule == EpisodeRule::kTwitch && msv[t] < c) peak = 0;
    const bool rises = msv[t] >= c && (t == 0 || msv[t - 1] <= c);
    const double later = peak;
    peak = std::max(peak, msv[t]);
    if (rises && (rule == EpisodeRule::kLiteral ? later : peak) > high) found.push_back({t, peak});
  }
  std::reverse(found.begin(), found.end());
  return found;
}

std::vector<Boundary> FindEndings(const Eigen::Ref<const Eigen::VectorXd>& msv,
                                  const Thresholds& thresholds, EpisodeRule rule) {
  const Eigen::VectorXd reversed = msv.reverse();
  std::vector<Boundary> found = FindBeginnings(reversed, thresholds, rule);
  for (Boundary& boundary : found)
    boundary.frame = static_cast<int>(msv.size()) - 1 - boundary.frame;
  std::reverse(found.begin(), found.end());
  return found;
}

Segmentation Segment(const UniformTrial& trial, const LearnOptions& options) {
  Segmentation result;
  result.msv = MeanSquaredVelocity(trial);
  const auto n = static_cast<int>(result.msv.size());
  const std::vector<Touch> touches = FindTouches(trial.touch_n);
  if (!touches.empty()) {
    Eigen::VectorXd rate = signal::Derivative(trial.touch_n, Step(trial));
    if (options.force_rate == ForceRate::kAbsolute) rate = rate.cwiseAbs();
    const double deviation = signal::Deviation(rate);
    if (deviation > 0) {
      result.c_tactile = signal::Deviation(result.msv) / deviation;
      result.touch_term = result.c_tactile * rate;
      result.msv += result.touch_term;
    }
  }
  const Thresholds thresholds = FindThresholds(result.msv);
  result.c = thresholds.c;
  result.k = thresholds.k;
  result.c_replaced = thresholds.c_replaced;

  const auto add = [&](const Boundary& boundary, MarkerKind kind) {
    const bool edge = boundary.frame == (kind == MarkerKind::kBeginning ? 0 : n - 1);
    const char* edge_cause = kind == MarkerKind::kBeginning ? "first sample" : "last sample";
    result.markers.push_back({trial.time_s[static_cast<std::size_t>(boundary.frame)],
                              boundary.frame, kind, edge ? edge_cause : "motion",
                              boundary.peak / thresholds.high()});
  };
  for (const Boundary& b : FindBeginnings(result.msv, thresholds, options.rule)) {
    add(b, MarkerKind::kBeginning);
  }
  for (const Boundary& b : FindEndings(result.msv, thresholds, options.rule)) {
    add(b, MarkerKind::kEnding);
  }
  if (options.force_rate == ForceRate::kAbsolute) {
    for (Marker& marker : TouchMarkers(touches, trial)) result.markers.push_back(std::move(marker));
  }
  std::stable_sort(result.markers.begin(), result.markers.end(),
                   [](const Marker& a, const Marker& b) { return a.frame < b.frame; });
  return result;
}

}  // namespace exemplar::learning
