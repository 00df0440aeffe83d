#include "exemplar/ircp/clock_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace exemplar::ircp {
namespace {

constexpr std::size_t kMostRemembered = 120;
constexpr Duration kLongestRemembered = std::chrono::minutes(3);
constexpr Duration kLongestDelay = std::chrono::seconds(1);
// Stamping and waking a thread cost about this much, at best.
constexpr double kNoiseFloorS = 10e-6;
// Quartz clocks drift by some tens of parts in a million.
constexpr double kUsualDrift = 100e-6;
// Adjusted clocks run wrong by no more than 500 parts in a million (NTP), plus their own drift.
constexpr double kLargestDrift = 700e-6;
// A clock's drift changes by about this much, with its temperature.
constexpr double kDriftError = 20e-6;
constexpr Duration kSmallestJump = std::chrono::milliseconds(1);

/// How far an exchange's offset is usually off, in seconds.
double Sigma(const ClockExchange& exchange, Duration quickest) {
  return kNoiseFloorS + ToSeconds(exchange.delay() - quickest) / 2;
}

}  // namespace

std::optional<Duration> ClockEstimator::Add(const ClockExchange& exchange) {
  for (const Stamp stamp :
       {exchange.sent, exchange.their_received, exchange.their_sent, exchange.received}) {
    if (!IsOfOurTime(stamp)) return std::nullopt;
  }
  const Duration delay = exchange.delay();
  if (delay < Duration(0) || delay > kLongestDelay) return std::nullopt;
  std::optional<Duration> jump;
  if (IsExcluded(exchange)) {
    jump = exchange.offset() - window_.back().offset();
    StartEpoch(exchange.middle());
  }
  if (window_.empty() && epoch_ == 0) since_ = exchange.middle();
  window_.push_back(exchange);
  ++exchanges_;
  while (window_.size() > kMostRemembered ||
         exchange.middle() - window_.front().middle() > kLongestRemembered) {
    window_.pop_front();
  }
  return jump;
}

bool ClockEstimator::IsExcluded(const ClockExchange& exchange) const {
  return std::any_of(window_.begin(), window_.end(), [&](const ClockExchange& before) {
    const double drifted_s =
        kLargestDrift * std::abs(ToSeconds(exchange.middle() - before.middle()));
    const Duration certain = (exchange.delay() + before.delay()) / 2 + FromSeconds(drifted_s);
    return std::chrono::abs(exchange.offset() - before.offset()) > std::max(certain, kSmallestJump);
  });
}

void ClockEstimator::StartEpoch(Stamp since) {
  window_.clear();
  ++epoch_;
  since_ = since;
}

ClockEstimator::Line ClockEstimator::Fit() const {
  // Weighted least squares about the newest exchange, with a Gaussian prior on the drift.
  Duration quickest = window_.front().delay();
  for (const ClockExchange& exchange : window_) quickest = std::min(quickest, exchange.delay());
  const ClockExchange& newest = window_.back();
  double w = 0;
  double wx = 0;
  double wy = 0;
  double wxx = 1 / (kUsualDrift * kUsualDrift);
  double wxy = 0;
  for (const ClockExchange& exchange : window_) {
    const double sigma_s = Sigma(exchange, quickest);
    const double weight = 1 / (sigma_s * sigma_s);
    const double x = ToSeconds(exchange.middle() - newest.middle());
    const double y = ToSeconds(exchange.offset() - newest.offset());
    w += weight;
    wx += weight * x;
    wy += weight * y;
    wxx += weight * x * x;
    wxy += weight * x * y;
  }
  const double determinant = w * wxx - wx * wx;  // positive: the prior alone makes it so
  Line line{.offset_s = (wxx * wy - wx * wxy) / determinant,
            .drift = (w * wxy - wx * wy) / determinant};
  double misfit = 0;
  for (const ClockExchange& exchange : window_) {
    const double x = ToSeconds(exchange.middle() - newest.middle());
    const double y = ToSeconds(exchange.offset() - newest.offset());
    const double beside = (line.offset_s + line.drift * x - y) / Sigma(exchange, quickest);
    misfit += beside * beside;
  }
  const double scale = std::max(1.0, misfit / static_cast<double>(window_.size()));
  line.drift_error = kDriftError + 2 * std::sqrt(scale * w / determinant);
  return line;
}

std::optional<ClockRelation> ClockEstimator::RelationAt(Stamp now) const {
  if (window_.empty()) return std::nullopt;
  const Line line = Fit();
  const ClockExchange& newest = window_.back();
  ClockRelation relation;
  relation.at = now;
  relation.drift = line.drift;
  const double since_newest_s = ToSeconds(now - newest.middle());
  const double fitted_s = line.offset_s + line.drift * since_newest_s;
  relation.offset = newest.offset() + FromSeconds(fitted_s);
  double uncertainty_s = std::numeric_limits<double>::infinity();
  for (const ClockExchange& exchange : window_) {
    const double x = ToSeconds(exchange.middle() - newest.middle());
    const double y = ToSeconds(exchange.offset() - newest.offset());
    const double beside_s = std::abs(line.offset_s + line.drift * x - y);
    uncertainty_s = std::min(uncertainty_s, beside_s + ToSeconds(exchange.delay()) / 2 +
                                                line.drift_error * std::abs(since_newest_s - x));
  }
  relation.uncertainty = FromSeconds(uncertainty_s);
  relation.exchanges = exchanges_;
  relation.epoch = epoch_;
  relation.since = since_;
  return relation;
}

}  // namespace exemplar::ircp
