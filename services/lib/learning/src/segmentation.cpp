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
  msv += length_squared * TurningSpeedSquared(trial);
  return msv;
}

ThresholdsAlong Constant(const Thresholds& thresholds, Eigen::Index n) {
  return {Eigen::VectorXd::Constant(n, thresholds.c),
          Eigen::VectorXd::Constant(n, thresholds.high())};
}

// Of threshold=local: the window, as a part of the trial; the quantile that is rest, and how far
// above it an episode's peak lies at least; the least c k as a part of the whole trial's, and the
// least c as a part of c k.
constexpr double kWindowPart = 0.08;
constexpr double kRestQuantile = 0.02;
constexpr double kOverRest = 100;
constexpr double kLeastHighPart = 5e-3;
constexpr double kLeastRatio = 0.05;

// The tool turns if it does so by more than this, at any time.
constexpr double kLeastTurn_rad = 0.2;

// Means over up to 2 half + 1 neighbours, fewer at the ends.
Eigen::VectorXd WindowMeans(const Eigen::VectorXd& values, Eigen::Index half) {
  const Eigen::Index n = values.size();
  Eigen::VectorXd sums(n + 1);
  sums[0] = 0;
  for (Eigen::Index k = 0; k < n; ++k) sums[k + 1] = sums[k] + values[k];
  Eigen::VectorXd means(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Index first = std::max<Eigen::Index>(0, k - half);
    const Eigen::Index behind = std::min(n, k + half + 1);
    means[k] = (sums[behind] - sums[first]) / static_cast<double>(behind - first);
  }
  return means;
}

// Beginnings and endings of a series; `cause` names those that are not at the trial's ends.
void AddBoundaries(const UniformTrial& trial, const Eigen::VectorXd& series,
                   const ThresholdsAlong& thresholds, EpisodeRule rule, const char* cause,
                   std::vector<Marker>& markers) {
  const auto last = static_cast<int>(series.size()) - 1;
  const auto add = [&](const Boundary& boundary, MarkerKind kind) {
    const bool beginning = kind == MarkerKind::kBeginning;
    const bool edge = boundary.frame == (beginning ? 0 : last);
    const char* edge_cause = beginning ? "first sample" : "last sample";
    markers.push_back({trial.time_s[static_cast<std::size_t>(boundary.frame)], boundary.frame, kind,
                       edge ? edge_cause : cause, boundary.score});
  };
  for (const Boundary& b : FindBeginnings(series, thresholds, rule)) add(b, MarkerKind::kBeginning);
  for (const Boundary& b : FindEndings(series, thresholds, rule)) add(b, MarkerKind::kEnding);
}

// A tool that hardly turns has no orientation to speak of.
bool Turns(const UniformTrial& trial) {
  return std::any_of(
      trial.base_T_tool.begin(), trial.base_T_tool.end(), [&](const geometry::Pose& pose) {
        return geometry::AngleBetween(pose.rotation, trial.base_T_tool.front().rotation) >
               kLeastTurn_rad;
      });
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

Eigen::VectorXd TurningSpeedSquared(const UniformTrial& trial) {
  const auto n = static_cast<Eigen::Index>(trial.base_T_tool.size());
  if (!trial.has_orientation || n < 2) return {};
  const double step_s = Step(trial);
  Eigen::VectorXd squared(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Index before = std::max<Eigen::Index>(0, k - 1);
    const Eigen::Index after = std::min<Eigen::Index>(n - 1, k + 1);
    const double angle =
        geometry::AngleBetween(trial.base_T_tool[static_cast<std::size_t>(before)].rotation,
                               trial.base_T_tool[static_cast<std::size_t>(after)].rotation);
    const double speed = angle / (static_cast<double>(after - before) * step_s);
    squared[k] = speed * speed;
  }
  return squared;
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

ThresholdsAlong FindThresholdsAlong(const Eigen::Ref<const Eigen::VectorXd>& msv) {
  const auto n = msv.size();
  const Thresholds whole = FindThresholds(msv);
  // Means over three windows after one another: a smooth bell that ends.
  const Eigen::Index half =
      std::max<Eigen::Index>(2, std::lround(kWindowPart * static_cast<double>(n) / 2));
  Eigen::VectorXd mean = msv;
  Eigen::VectorXd square = msv.cwiseProduct(msv);
  for (int pass = 0; pass < 3; ++pass) {
    mean = WindowMeans(mean, half);
    square = WindowMeans(square, half);
  }
  const Eigen::VectorXd deviation = (square - mean.cwiseProduct(mean)).cwiseMax(0).cwiseSqrt();
  const double rest = n > 0 ? std::max(0.0, signal::Quantile(msv, kRestQuantile)) : 0;
  const double least_high = std::max(kLeastHighPart * whole.high(), kOverRest * rest);
  // Lower where it is quiet, never higher than the whole trial's where it is not: what these find
  // is found still.
  ThresholdsAlong along;
  along.high = (mean + deviation / 2).cwiseMin(whole.high()).cwiseMax(least_high);
  // As FindThresholds: where the formula gives next to nothing, a part of c k.
  along.c = (mean - deviation / 2).cwiseMin(whole.c).cwiseMax(kLeastRatio * along.high);
  return along;
}

std::vector<Boundary> FindBeginnings(const Eigen::Ref<const Eigen::VectorXd>& msv,
                                     const ThresholdsAlong& thresholds, EpisodeRule rule) {
  const auto n = static_cast<int>(msv.size());
  const Eigen::VectorXd& c = thresholds.c;
  std::vector<Boundary> found;
  if (n == 0 || !(c.minCoeff() > 0)) return found;
  // Backwards, so that the peak of what follows is at hand: until the fall below c, or to the end.
  Boundary highest;
  for (int t = n - 1; t >= 0; --t) {
    if (rule == EpisodeRule::kTwitch && msv[t] < c[t]) highest = {};
    const bool rises = msv[t] >= c[t] && (t == 0 || msv[t - 1] <= c[t - 1]);
    const double later = highest.score;
    const double score = msv[t] / thresholds.high[t];
    if (score > highest.score) highest = {t, msv[t], score};
    if (rises && (rule == EpisodeRule::kLiteral ? later : highest.score) > 1) {
      found.push_back({t, highest.peak, highest.score});
    }
  }
  std::reverse(found.begin(), found.end());
  return found;
}

std::vector<Boundary> FindBeginnings(const Eigen::Ref<const Eigen::VectorXd>& msv,
                                     const Thresholds& thresholds, EpisodeRule rule) {
  return FindBeginnings(msv, Constant(thresholds, msv.size()), rule);
}

std::vector<Boundary> FindEndings(const Eigen::Ref<const Eigen::VectorXd>& msv,
                                  const ThresholdsAlong& thresholds, EpisodeRule rule) {
  const Eigen::VectorXd reversed = msv.reverse();
  std::vector<Boundary> found = FindBeginnings(
      reversed, ThresholdsAlong{thresholds.c.reverse(), thresholds.high.reverse()}, rule);
  for (Boundary& boundary : found)
    boundary.frame = static_cast<int>(msv.size()) - 1 - boundary.frame;
  std::reverse(found.begin(), found.end());
  return found;
}

std::vector<Boundary> FindEndings(const Eigen::Ref<const Eigen::VectorXd>& msv,
                                  const Thresholds& thresholds, EpisodeRule rule) {
  return FindEndings(msv, Constant(thresholds, msv.size()), rule);
}

Segmentation Segment(const UniformTrial& trial, const LearnOptions& options) {
  Segmentation result;
  result.msv = MeanSquaredVelocity(trial);
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

  ThresholdsAlong along = Constant(thresholds, result.msv.size());
  if (options.threshold == ThresholdRule::kLocal) {
    along = FindThresholdsAlong(result.msv);
    result.c_along = along.c;
    result.high_along = along.high;
  }
  AddBoundaries(trial, result.msv, along, options.rule, "motion", result.markers);
  if (options.cues.orientation && Turns(trial)) {
    const Eigen::VectorXd turning = TurningSpeedSquared(trial);
    AddBoundaries(trial, turning,
                  options.threshold == ThresholdRule::kLocal
                      ? FindThresholdsAlong(turning)
                      : Constant(FindThresholds(turning), turning.size()),
                  options.rule, "orientation", result.markers);
  }
  if (options.cues.extrema) {
    for (Marker& marker : FindExtrema(trial)) result.markers.push_back(std::move(marker));
  }
  if (options.force_rate == ForceRate::kAbsolute) {
    for (Marker& marker : TouchMarkers(touches, trial)) result.markers.push_back(std::move(marker));
  }
  std::stable_sort(result.markers.begin(), result.markers.end(),
                   [](const Marker& a, const Marker& b) { return a.frame < b.frame; });
  return result;
}

}  // namespace exemplar::learning
