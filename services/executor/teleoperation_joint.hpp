#pragma once
// One joint that follows an operator: within limits of velocity, acceleration and jerk, and always
// with a way to come to rest.

#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::executor {

/// Position, velocity, acceleration; rad or m, and seconds.
struct JointMotion {
  double position = 0;
  double velocity = 0;
  double acceleration = 0;
};

/// Positive bounds of the following.
struct FollowLimits {
  double velocity = 0;
  double acceleration = 0;
  double jerk = 0;
};

/// A twentieth less than the joint's own, so that nothing that rounds goes beyond them.
FollowLimits LimitsFor(const kinematics::JointLimits& joint);

/// How quick following is, 1/s: all three poles lie here as long as no limit is met.
inline constexpr double kFollowBandwidth = 45;

/// `elapsed_s` later, on the way to a target that moves at `target_velocity`. Keeps to the limits
/// where `from` does; above the velocity allowed it slows down. Makes about one turn of a loop a
/// millisecond and does not allocate.
JointMotion Follow(const JointMotion& from, double target, double target_velocity,
                   const FollowLimits& limits, double elapsed_s);

/// The quickest way to rest within acceleration and jerk: three pieces of constant jerk.
class Brake {
 public:
  Brake() = default;
  /// Precondition: |from.acceleration| <= limits.acceleration.
  Brake(const JointMotion& from, const FollowLimits& limits);

  double duration_s() const { return end_s_[2]; }
  /// At rest from duration_s() on.
  JointMotion At(double time_s) const;
  /// The way made between two times, there and back. Precondition: begin_s <= end_s.
  double Travel(double begin_s, double end_s) const;
  /// The lowest and the highest position on the way.
  double lowest() const;
  double highest() const;

 private:
  JointMotion from_;
  double end_s_[3] = {0, 0, 0};  ///< of the pieces
  double jerk_[3] = {0, 0, 0};
  JointMotion at_[3];     ///< at the begin of each piece
  double turn_s_ = -1;    ///< where the joint turns round, if it does
  double turned_at_ = 0;  ///< position there
  double rests_at_ = 0;
};

}  // namespace exemplar::executor
