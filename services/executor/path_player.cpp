#include "executor/path_player.hpp"

#include <algorithm>
#include <cmath>

namespace exemplar::executor {

void PathPlayer::Advance(double elapsed_s, double target_rate, double slope_per_s) {
  const double missing = target_rate - rate_;
  const double ramp_s = std::min(elapsed_s, std::abs(missing) / slope_per_s);
  const double reached =
      ramp_s < elapsed_s ? target_rate : rate_ + std::copysign(slope_per_s * ramp_s, missing);
  time_s_ += 0.5 * (rate_ + reached) * ramp_s + reached * (elapsed_s - ramp_s);
  rate_ = reached;
  time_s_ = std::min(time_s_, trajectory_.duration_s());
}

void PathPlayer::Evaluate(Eigen::Ref<Eigen::VectorXd> position,
                          Eigen::Ref<Eigen::VectorXd> velocity) const {
  motion::Evaluate(trajectory_, time_s_, position, velocity);
  velocity *= rate_;
}

}  // namespace exemplar::executor
