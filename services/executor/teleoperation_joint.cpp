#include "executor/teleoperation_joint.hpp"

#include <algorithm>
#include <cmath>

namespace exemplar::executor {
namespace {

constexpr double kStep_s = 1e-3;
constexpr double kShareOfLimits = 0.95;
/// Of what the limits allow: what is left over makes up for what follows late.
constexpr double kBrakingShare = 0.6;
constexpr double kBrakingJerkShare = 0.3;

JointMotion After(const JointMotion& from, double jerk, double t) {
  return {from.position + t * (from.velocity + t * (from.acceleration / 2 + t * jerk / 6)),
          from.velocity + t * (from.acceleration + t * jerk / 2), from.acceleration + t * jerk};
}

/// What to ask of the derivative so that `error` goes to zero: in proportion where it is small,
/// beyond that no more than can be braked by `deceleration`.
double RateFor(double error, double gain, double deceleration) {
  const double small = deceleration / (gain * gain);
  const double size = std::abs(error);
  if (size <= small) return gain * error;
  return std::copysign(std::sqrt(2 * deceleration * (size - small / 2)), error);
}

/// The velocity from which one comes to rest within `way`.
double SpeedFor(double way, double deceleration, double jerk) {
  // Slower than this the deceleration is not reached.
  const double edge = deceleration * deceleration / jerk;
  if (way * way * jerk <= edge * edge * edge) return std::cbrt(way * way * jerk);
  const double half = edge / 2;
  return std::sqrt(half * half + 2 * deceleration * way) - half;
}

}  // namespace

FollowLimits LimitsFor(const kinematics::JointLimits& joint) {
  return {kShareOfLimits * joint.velocity, kShareOfLimits * joint.acceleration,
          kShareOfLimits * joint.jerk};
}

JointMotion Follow(const JointMotion& from, double target, double target_velocity,
                   const FollowLimits& limits, double elapsed_s) {
  constexpr double kPositionGain = kFollowBandwidth / 3;
  constexpr double kVelocityGain = kFollowBandwidth;
  constexpr double kAccelerationGain = 3 * kFollowBandwidth;
  const int steps = std::max(1, static_cast<int>(std::ceil(elapsed_s / kStep_s - 1e-9)));
  const double h = elapsed_s / steps;
  JointMotion now = from;
  for (int step = 0; step < steps; ++step) {
    const double error = target - now.position;
    const double closing = std::min(kPositionGain * std::abs(error),
                                    SpeedFor(std::abs(error), kBrakingShare * limits.acceleration,
                                             kBrakingJerkShare * limits.jerk));
    const double velocity = std::clamp(target_velocity + std::copysign(closing, error),
                                       -limits.velocity, limits.velocity);
    const double acceleration =
        std::clamp(RateFor(velocity - now.velocity, kVelocityGain, kBrakingShare * limits.jerk),
                   -limits.acceleration, limits.acceleration);
    const double jerk = std::clamp(kAccelerationGain * (acceleration - now.acceleration),
                                   -limits.jerk, limits.jerk);
    now = After(now, jerk, h);
    target += h * target_velocity;
  }
  return now;
}

Brake::Brake(const JointMotion& from, const FollowLimits& limits) : from_(from) {
  const double j = limits.jerk;
  const double a0 = from.acceleration;
  // The velocity once the acceleration has gone: on that side the braking is done.
  const double coasting = from.velocity + a0 * std::abs(a0) / (2 * j);
  const double side = coasting < 0 ? -1 : 1;
  const double v = side * from.velocity;
  const double a = side * a0;
  double peak = std::sqrt(std::max(0.0, j * v + a * a / 2));
  double level_s = 0;
  if (peak > limits.acceleration) {
    peak = std::max(limits.acceleration, -a);
    level_s = std::max(0.0, (v + a * a / (2 * j) - peak * peak / j) / peak);
  }
  const double first_s = std::max(0.0, (a + peak) / j);
  end_s_[0] = first_s;
  end_s_[1] = first_s + level_s;
  end_s_[2] = end_s_[1] + peak / j;
  jerk_[0] = -side * j;
  jerk_[1] = 0;
  jerk_[2] = side * j;
  at_[0] = from;
  at_[1] = After(at_[0], jerk_[0], end_s_[0]);
  at_[2] = After(at_[1], jerk_[1], end_s_[1] - end_s_[0]);
  rests_at_ = After(at_[2], jerk_[2], end_s_[2] - end_s_[1]).position;
  if (v < 0 && a > 0 && a * a + 2 * j * v >= 0) {
    turn_s_ = (a - std::sqrt(a * a + 2 * j * v)) / j;
    turned_at_ = After(from, jerk_[0], turn_s_).position;
  }
}

JointMotion Brake::At(double time_s) const {
  if (time_s >= end_s_[2]) return {rests_at_, 0, 0};
  if (time_s < end_s_[0]) return After(at_[0], jerk_[0], time_s);
  if (time_s < end_s_[1]) return After(at_[1], jerk_[1], time_s - end_s_[0]);
  return After(at_[2], jerk_[2], time_s - end_s_[1]);
}

double Brake::Travel(double begin_s, double end_s) const {
  const double begin = At(begin_s).position;
  const double end = At(end_s).position;
  if (turn_s_ <= begin_s || turn_s_ >= end_s) return std::abs(end - begin);
  return std::abs(turned_at_ - begin) + std::abs(end - turned_at_);
}

double Brake::lowest() const {
  const double ends = std::min(from_.position, rests_at_);
  return turn_s_ > 0 ? std::min(ends, turned_at_) : ends;
}

double Brake::highest() const {
  const double ends = std::max(from_.position, rests_at_);
  return turn_s_ > 0 ? std::max(ends, turned_at_) : ends;
}

}  // namespace exemplar::executor
