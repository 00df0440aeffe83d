#include "executor/path_player.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace exemplar::executor {
namespace {

constexpr double kShortestRamp_s = 0.02;
constexpr double kLongestRamp_s = 8;
/// A stop takes at most this long, and begins at once.
constexpr double kLongestStop_s = 0.5;
/// Each ramp that is tried is longer by this.
constexpr double kLonger = 1.2;
constexpr double kCheckStep_s = 0.004;
constexpr int kMostChecks = 160;
/// A change of mind may carry the rate so far past where it was going.
constexpr double kOvershoot = 0.05;
/// Of the limits; the plan itself leaves a little more, and checks are that far apart.
constexpr double kLimitShare = 0.99;

}  // namespace

double PathPlayer::Ramp::Rate(double t) const {
  if (t >= duration_s) return target;
  const auto& c = coefficients;
  return c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))));
}

double PathPlayer::Ramp::Slope(double t) const {
  if (t >= duration_s) return 0;
  const auto& c = coefficients;
  return c[1] + t * (2 * c[2] + t * (3 * c[3] + t * (4 * c[4] + t * 5 * c[5])));
}

double PathPlayer::Ramp::Bend(double t) const {
  if (t >= duration_s) return 0;
  const auto& c = coefficients;
  return 2 * c[2] + t * (6 * c[3] + t * (12 * c[4] + t * 20 * c[5]));
}

double PathPlayer::Ramp::Way(double t) const {
  const double u = std::min(t, duration_s);
  const auto& c = coefficients;
  const double ramped =
      u * (c[0] + u * (c[1] / 2 + u * (c[2] / 3 + u * (c[3] / 4 + u * (c[4] / 5 + u * c[5] / 6)))));
  return ramped + target * (t - u);
}

PathPlayer::PathPlayer(const motion::JointTrajectory& trajectory,
                       std::vector<kinematics::JointLimits> limits)
    : trajectory_(trajectory), limits_(std::move(limits)) {
  assert(static_cast<Eigen::Index>(limits_.size()) == trajectory.positions.cols());
}

void PathPlayer::Advance(double elapsed_s, double target_rate, double slope_per_s) {
  if (target_rate != ramp_.target) Begin(target_rate, slope_per_s);
  ramp_s_ += elapsed_s;
  rate_ = ramp_.Rate(ramp_s_);
  time_s_ = std::clamp(ramp_begin_time_s_ + ramp_.Way(ramp_s_), time_s_, trajectory_.duration_s());
}

void PathPlayer::SkipTo(double time_s) {
  ramp_begin_time_s_ += time_s - time_s_;
  time_s_ = time_s;
}

void PathPlayer::Begin(double target_rate, double slope_per_s) {
  const double shortest = std::max(std::abs(target_rate - rate_) / slope_per_s, kShortestRamp_s);
  const double longest = target_rate == 0 ? std::max(shortest, kLongestStop_s) : kLongestRamp_s;
  for (double duration = shortest; duration <= longest; duration *= kLonger) {
    const Ramp ramp = RampTo(target_rate, duration, ramp_.Slope(ramp_s_), ramp_.Bend(ramp_s_));
    if (!KeepsLimits(ramp)) continue;
    Follow(ramp, true);
    return;
  }
  // Without the present slope the rate only falls, so that velocity at least stays within limits.
  if (target_rate == 0) Follow(RampTo(target_rate, longest, 0, 0), false);
}

void PathPlayer::Follow(const Ramp& ramp, bool keeps_limits) {
  keeps_limits_ = keeps_limits;
  ramp_ = ramp;
  ramp_s_ = 0;
  ramp_begin_time_s_ = time_s_;
}

PathPlayer::Ramp PathPlayer::RampTo(double target_rate, double duration_s, double slope_per_s,
                                    double bend_per_s2) const {
  const double d = duration_s;
  const double slope = slope_per_s * d;
  const double bend = bend_per_s2 * d * d;
  const double missing = target_rate - rate_;
  Ramp ramp;
  ramp.duration_s = d;
  ramp.target = target_rate;
  ramp.coefficients = {rate_,
                       slope / d,
                       bend / 2 / (d * d),
                       (10 * missing - 6 * slope - 1.5 * bend) / (d * d * d),
                       (-15 * missing + 8 * slope + 1.5 * bend) / (d * d * d * d),
                       (6 * missing - 3 * slope - 0.5 * bend) / (d * d * d * d * d)};
  return ramp;
}

bool PathPlayer::KeepsLimits(const Ramp& ramp) const {
  const int checks =
      std::clamp(static_cast<int>(std::ceil(ramp.duration_s / kCheckStep_s)), 16, kMostChecks);
  const double highest = std::max(rate_, ramp.target) + kOvershoot;
  for (int i = 0; i < checks; ++i) {
    const double t = ramp.duration_s * i / checks;
    const double rate = ramp.Rate(t);
    if (rate < 0 || rate > highest) return false;
    if (!KeepsLimits(time_s_ + ramp.Way(t), rate, ramp.Slope(t), ramp.Bend(t))) return false;
  }
  return true;
}

bool PathPlayer::KeepsLimits(double path_time_s, double rate, double slope, double bend) const {
  const std::vector<double>& time = trajectory_.time_s;
  if (time.size() < 2 || path_time_s >= time.back()) return true;  // at rest there
  const auto after = std::upper_bound(time.begin() + 1, time.end() - 1, path_time_s);
  const auto i = static_cast<Eigen::Index>(after - time.begin()) - 1;
  const double h = time[i + 1] - time[i];
  const double within = std::max(0.0, path_time_s - time[i]);
  for (Eigen::Index j = 0; j < trajectory_.positions.cols(); ++j) {
    const double mean = (trajectory_.positions(i + 1, j) - trajectory_.positions(i, j)) / h;
    const double v0 = trajectory_.velocities(i, j);
    const double v1 = trajectory_.velocities(i + 1, j);
    // The piece's derivatives by the plan's time.
    const double a0 = (6 * mean - 4 * v0 - 2 * v1) / h;
    const double third = (6 * v0 + 6 * v1 - 12 * mean) / (h * h);
    const double second = a0 + within * third;
    const double first = v0 + within * (a0 + 0.5 * within * third);
    const kinematics::JointLimits& limits = limits_[static_cast<std::size_t>(j)];
    const double velocity = first * rate;
    const double acceleration = second * rate * rate + first * slope;
    const double jerk = third * rate * rate * rate + 3 * second * rate * slope + first * bend;
    if (std::abs(velocity) > kLimitShare * limits.velocity ||
        std::abs(acceleration) > kLimitShare * limits.acceleration ||
        std::abs(jerk) > kLimitShare * limits.jerk) {
      return false;
    }
  }
  return true;
}

void PathPlayer::Evaluate(Eigen::Ref<Eigen::VectorXd> position,
                          Eigen::Ref<Eigen::VectorXd> velocity) const {
  motion::Evaluate(trajectory_, time_s_, position, velocity);
  velocity *= rate_;
}

}  // namespace exemplar::executor
