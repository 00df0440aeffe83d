#pragma once
// Where on a planned path the robot is to be, and how fast it runs along it.

#include <array>
#include <vector>

#include "exemplar/motion/plan.hpp"

namespace exemplar::executor {

/// Speed changes act along the path only: the robot never leaves it. They are as quick as the
/// joints' velocity, acceleration and jerk limits allow at that place of the path, checked over the
/// whole change before it begins; until one is possible the present one goes on. A stop (rate 0)
/// never waits: where none within half a second keeps the limits, it takes half a second and breaks
/// those of acceleration and jerk.
/// Thread-compatible; does not allocate after construction.
class PathPlayer {
 public:
  /// Keeps a reference. Begins at rest at the first frame. `limits`: one a joint.
  PathPlayer(const motion::JointTrajectory& trajectory,
             std::vector<kinematics::JointLimits> limits);

  /// Moves on by `elapsed_s` while the rate changes towards `target_rate` (1: as planned), by at
  /// most `slope_per_s` on average.
  void Advance(double elapsed_s, double target_rate, double slope_per_s);

  /// Goes on from another time of the plan at the present rate.
  void SkipTo(double time_s);

  double time_s() const { return time_s_; }  ///< on the plan's time
  double rate() const { return rate_; }
  bool at_end() const { return time_s_ >= trajectory_.duration_s(); }
  /// False while a stop is on its way that had to break limits of acceleration or jerk.
  bool keeps_limits() const { return keeps_limits_; }
  /// Velocities are those that the present rate makes.
  void Evaluate(Eigen::Ref<Eigen::VectorXd> position, Eigen::Ref<Eigen::VectorXd> velocity) const;

 private:
  /// A rate over time as a polynomial of fifth degree, constant after `duration_s`.
  struct Ramp {
    std::array<double, 6> coefficients{};
    double duration_s = 0;
    double target = 0;

    double Rate(double t) const;
    double Slope(double t) const;
    double Bend(double t) const;
    double Way(double t) const;  ///< of the path, since the ramp's begin
  };

  void Begin(double target_rate, double slope_per_s);
  void Follow(const Ramp& ramp, bool keeps_limits);
  /// From the present rate and the given slope and bend to a rate that stays.
  Ramp RampTo(double target_rate, double duration_s, double slope_per_s, double bend_per_s2) const;
  bool KeepsLimits(const Ramp& ramp) const;
  bool KeepsLimits(double path_time_s, double rate, double slope, double bend) const;

  const motion::JointTrajectory& trajectory_;
  const std::vector<kinematics::JointLimits> limits_;
  double time_s_ = 0;
  double rate_ = 0;
  Ramp ramp_;
  double ramp_s_ = 0;  ///< since the ramp began
  double ramp_begin_time_s_ = 0;
  bool keeps_limits_ = true;
};

}  // namespace exemplar::executor
