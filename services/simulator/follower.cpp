#include "simulator/follower.hpp"

#include <algorithm>
#include <cmath>

namespace exemplar::simulator {
namespace {

constexpr std::size_t kKept = 16;  // samples; more than a playback delay holds at 200 Hz

Duration SinceEpoch(Stamp stamp) { return Duration(stamp.nanoseconds()); }

}  // namespace

Follower::Follower(std::vector<kinematics::JointLimits> limits, const Eigen::VectorXd& start,
                   FollowerOptions options)
    : limits_(std::move(limits)),
      options_(options),
      last_{start, Eigen::VectorXd::Zero(start.size())} {}

void Follower::Command(Duration now, Setpoint setpoint, Duration validity) {
  if (smooth_ || mode_ != Mode::kFollowing) samples_.clear();
  smooth_ = false;
  mode_ = Mode::kFollowing;
  validity_ = validity > Duration::zero() ? validity : options_.patience;
  acted_seq_ = setpoint.seq;
  samples_.push_back({now, std::move(setpoint)});
  if (samples_.size() > 2) samples_.pop_front();
}

void Follower::Stream(Duration now, Setpoint setpoint) {
  const bool fresh = !smooth_ || mode_ != Mode::kFollowing || samples_.empty();
  if (fresh) samples_.clear();
  smooth_ = true;
  mode_ = Mode::kFollowing;
  validity_ = options_.patience;
  acted_seq_ = setpoint.seq;
  if (!samples_.empty() && setpoint.stamp <= samples_.back().setpoint.stamp) return;
  const Duration offset = now - SinceEpoch(setpoint.stamp);
  stamp_to_local_ = fresh ? offset : std::min(stamp_to_local_, offset);
  samples_.push_back({now, std::move(setpoint)});
  if (samples_.size() > kKept) samples_.pop_front();
}

Duration Follower::GoTo(Duration now, const Eigen::VectorXd& target) {
  constexpr double kPeakOfMinimumJerk = 1.875;  // peak speed over mean speed
  double seconds = 0.1;
  for (std::size_t i = 0; i < limits_.size(); ++i) {
    const double way = std::abs(target[static_cast<Eigen::Index>(i)] -
                                last_.positions[static_cast<Eigen::Index>(i)]);
    seconds = std::max(seconds, kPeakOfMinimumJerk * way / (0.5 * limits_[i].velocity));
  }
  mode_ = Mode::kGoingHome;
  way_start_ = last_.positions;
  way_end_ = target;
  way_begin_ = now;
  way_length_ = FromSeconds(seconds);
  return way_length_;
}

void Follower::HoldAt(const Eigen::VectorXd& positions) {
  last_ = {positions, Eigen::VectorXd::Zero(positions.size())};
  Hold();
}

void Follower::Hold() {
  mode_ = Mode::kHolding;
  samples_.clear();
  last_.velocities.setZero();
}

Follower::Output Follower::Extrapolated(Duration now) const {
  const Timed& newest = samples_.back();
  Output out{newest.setpoint.positions, newest.setpoint.velocities};
  Duration period = validity_;
  if (samples_.size() > 1) {
    period = newest.setpoint.stamp - samples_.front().setpoint.stamp;
  }
  if (out.velocities.size() == 0) {
    out.velocities = Eigen::VectorXd::Zero(out.positions.size());
    if (samples_.size() > 1 && period > Duration::zero()) {
      out.velocities =
          (newest.setpoint.positions - samples_.front().setpoint.positions) / ToSeconds(period);
    }
  }
  // A sample that is late by more than half a period is not guessed any further.
  const Duration age = now - newest.received;
  const Duration guess = std::clamp(period + period / 2, Duration::zero(), validity_);
  out.positions += ToSeconds(std::min(age, guess)) * out.velocities;
  if (age > guess) out.velocities.setZero();
  return out;
}

Follower::Output Follower::Interpolated(Duration now) {
  const Duration at = now - stamp_to_local_ - options_.playback_delay;
  while (samples_.size() > 2 && SinceEpoch(samples_[1].setpoint.stamp) <= at) samples_.pop_front();
  const Setpoint& before = samples_.front().setpoint;
  const Eigen::VectorXd still = Eigen::VectorXd::Zero(before.positions.size());
  if (samples_.size() == 1) return {before.positions, still};
  const Setpoint& after = samples_[1].setpoint;
  const double span = ToSeconds(after.stamp - before.stamp);
  const double s = ToSeconds(at - SinceEpoch(before.stamp)) / span;
  if (s < 0) return {before.positions, still};
  if (s > 1) return {after.positions, still};
  const Eigen::VectorXd way = after.positions - before.positions;
  return {before.positions + s * way, way / span};
}

Follower::Output Follower::OnTheWayHome(Duration now) {
  const double s = std::clamp(ToSeconds(now - way_begin_) / ToSeconds(way_length_), 0.0, 1.0);
  const double path = s * s * s * (10 - 15 * s + 6 * s * s);
  const double speed = 30 * s * s * (1 - s) * (1 - s) / ToSeconds(way_length_);
  const Eigen::VectorXd way = way_end_ - way_start_;
  if (s >= 1) mode_ = Mode::kHolding;
  return {way_start_ + path * way, speed * way};
}

Follower::Output Follower::Raw(Duration now) {
  if (mode_ == Mode::kGoingHome) return OnTheWayHome(now);
  if (mode_ == Mode::kFollowing && now - samples_.back().received > validity_) {
    ++stale_count_;
    Hold();
  }
  if (mode_ == Mode::kHolding) return {last_.positions, last_.velocities};
  return smooth_ ? Interpolated(now) : Extrapolated(now);
}

Follower::Output Follower::At(Duration now) {
  const double dt = started_ ? ToSeconds(now - last_now_) : 0;
  started_ = true;
  last_now_ = now;
  Output out = Raw(now);
  for (std::size_t i = 0; i < limits_.size(); ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    const kinematics::JointLimits& limit = limits_[i];
    if (limit.upper > limit.lower) {
      const double inside = std::clamp(out.positions[k], limit.lower, limit.upper);
      if (inside != out.positions[k]) out.velocities[k] = 0;
      out.positions[k] = inside;
    }
    const double most = limit.velocity * dt;
    const double way = out.positions[k] - last_.positions[k];
    if (std::abs(way) > most) {
      out.positions[k] = last_.positions[k] + std::copysign(most, way);
      out.velocities[k] = std::copysign(limit.velocity, way);
    } else {
      out.velocities[k] = std::clamp(out.velocities[k], -limit.velocity, limit.velocity);
    }
  }
  last_ = out;
  if (mode_ == Mode::kHolding) last_.velocities.setZero();
  return last_;
}

}  // namespace exemplar::simulator
