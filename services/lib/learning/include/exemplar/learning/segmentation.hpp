#pragma once
// Candidate episode boundaries: Eqs. 1 to 4 of the paper, the parts of Segment().

#include <Eigen/Core>
#include <vector>

#include "exemplar/learning/aligned.hpp"

namespace exemplar::learning {

/// Eq. 1 on a prepared trial: the summed squared joint velocities; without joints, the tool's
/// squared speed plus its squared angular speed times the square of a length. That length is the
/// tool's RMS distance from its mean place, over pi: half a turn counts as the way across the task.
Eigen::VectorXd MeanSquaredVelocity(const UniformTrial& trial);

/// Eqs. 3 and 4.
struct Thresholds {
  double c = 0;
  double k = 0;
  bool c_replaced = false;  ///< Eq. 3 gave c <= 0
  double high() const { return k * c; }
};
/// Where Eq. 3 is not positive (a spiky trial: sigma >= 2 mean), c k stays and c becomes three
/// times the median of the series, the level of rest, held between 1 % and 25 % of c k.
Thresholds FindThresholds(const Eigen::Ref<const Eigen::VectorXd>& msv);

/// c and c k at each frame (the paper's section 3.1: they may vary along the trial).
struct ThresholdsAlong {
  Eigen::VectorXd c;
  Eigen::VectorXd high;
};
/// Eqs. 3 and 4 with mean and deviation taken over the stretch around each frame, of about an
/// eighth of the trial; never so low that what is at rest in the whole trial counts as motion.
ThresholdsAlong FindThresholdsAlong(const Eigen::Ref<const Eigen::VectorXd>& msv);

/// An episode's boundary at `frame`, with the largest value of the high stretch it belongs to.
struct Boundary {
  int frame = 0;
  double peak = 0;
  double score = 0;  ///< the largest of the stretch over c k
};
/// Rises through c with a later value above c k: before the series falls below c again (kTwitch),
/// or anywhere later (kLiteral). A series that starts above c begins at frame 0.
std::vector<Boundary> FindBeginnings(const Eigen::Ref<const Eigen::VectorXd>& msv,
                                     const Thresholds& thresholds, EpisodeRule rule);
std::vector<Boundary> FindBeginnings(const Eigen::Ref<const Eigen::VectorXd>& msv,
                                     const ThresholdsAlong& thresholds, EpisodeRule rule);
/// The same on the series reversed in time: the last frame at or above c before each fall.
std::vector<Boundary> FindEndings(const Eigen::Ref<const Eigen::VectorXd>& msv,
                                  const Thresholds& thresholds, EpisodeRule rule);
std::vector<Boundary> FindEndings(const Eigen::Ref<const Eigen::VectorXd>& msv,
                                  const ThresholdsAlong& thresholds, EpisodeRule rule);

/// Squared angular speed of the tool, rad^2/s^2, one a frame; empty without its orientation.
Eigen::VectorXd TurningSpeedSquared(const UniformTrial& trial);

/// Where a joint (without joints: a coordinate of the tool) turns back after a good part of its
/// way: the turn itself, or the end of a rest there. In time order, one marker where several turn
/// together; the score is the part of the whole range that the smaller of both ways makes.
std::vector<Marker> FindExtrema(const UniformTrial& trial);

}  // namespace exemplar::learning
