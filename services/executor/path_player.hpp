#pragma once
// Where on a planned path the robot is to be, and how fast it runs along it.

#include "exemplar/motion/plan.hpp"

namespace exemplar::executor {

/// Speed changes act along the path only: the robot never leaves it. Thread-compatible; does not
/// allocate after construction.
class PathPlayer {
 public:
  /// Keeps a reference. Begins at rest at the first frame.
  explicit PathPlayer(const motion::JointTrajectory& trajectory) : trajectory_(trajectory) {}

  /// Moves on by `elapsed_s` while the rate changes towards `target_rate` (1: as planned) by at
  /// most `slope_per_s`.
  void Advance(double elapsed_s, double target_rate, double slope_per_s);

  double time_s() const { return time_s_; }  ///< on the plan's time
  double rate() const { return rate_; }
  bool at_end() const { return time_s_ >= trajectory_.duration_s(); }
  /// Velocities are those that the present rate makes.
  void Evaluate(Eigen::Ref<Eigen::VectorXd> position, Eigen::Ref<Eigen::VectorXd> velocity) const;

 private:
  const motion::JointTrajectory& trajectory_;
  double time_s_ = 0;
  double rate_ = 0;
};

}  // namespace exemplar::executor
