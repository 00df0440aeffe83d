#pragma once
// Tool positions as a sum of motions that belong to frames: method=frames.
//
//   x(t) = O + a(t) (s - O) + R A(t) R^T (s - O) + R b(t) + m(t) + z(t)
//
// s: start, O, R: target object. a: how much of the start is left at t (the start's frame); A
// diagonal: the same along each of the object's axes; b: what turns with the object; m: what keeps
// to the world; z: what changes smoothly with the situation. All parts are Gaussian with stated
// prior gains, so that the answer is one weighted sum of the trials (best linear prediction). The
// gains are chosen by closed-form leave-one-trial-out error, and the best few are averaged.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "block_kriging.hpp"
#include "exemplars.hpp"
#include "weighted_sum.hpp"

namespace exemplar::learning {

/// Prior variances of the parts, in units of the trials' noise.
struct FrameGains {
  double start_axes = 0;        ///< A
  double world = 0;             ///< m
  double residual = 0;          ///< z
  bool residual_turns = false;  ///< z is expressed in the object's frame
  bool by_orientation = true;   ///< z depends on how the object is turned as well as where it is
};

/// What a situation is, to this model.
struct FrameSituation {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  Eigen::Vector3d object = Eigen::Vector3d::Zero();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
};

class PathFrames {
 public:
  /// Precondition: exemplars.has_tool.
  explicit PathFrames(const Exemplars& exemplars);

  struct Answer {
    Eigen::MatrixX3d positions;  ///< one a frame, base frame
    Eigen::VectorXd sigma_m;     ///< frames
  };
  Answer Predict(const FrameSituation& situation) const;
  /// What a trial of the training set is predicted from the others, 3 x frames: closed form.
  Eigen::Matrix3Xd LeftOut(int trial) const;
  Eigen::Vector3d LeftOut(int trial, int frame) const;
  /// The deviation that its error should have, in units of the noise.
  double LeftOutSpread(int trial) const { return left_out_spread_[trial]; }
  int size() const { return static_cast<int>(situations_.size()); }
  /// Frees the left-out paths: LeftOut must not be called again.
  void ForgetLeftOut() { left_out_.resize(0, 0); }
  /// The largest distance (m) between a trial and what is predicted from the others.
  double LeftOutDistance(int trial) const { return left_out_distance_m_[trial]; }

  /// a(t) / a(0), clamped to [0, 1]: 1 in the start's frame, 0 in the object's.
  const Eigen::VectorXd& start_share() const { return start_share_; }
  /// Mean distance from start to object: the unit of lengths (m).
  double length_m() const { return length_m_; }
  /// How the first trial had the target turned.
  const Eigen::Matrix3d& shown_turn() const { return situations_.front().turn; }
  /// The parts that the best gains use, for the report.
  std::string Describe() const;
  FrameSituation From(const Situation& situation) const;

 private:
  /// What two situations have in common, before the gains.
  struct Likeness {
    Eigen::Matrix3d always;      ///< start and object
    Eigen::Matrix3d along_axes;  ///< A
    Eigen::Matrix3d turn;        ///< from b's object to a's
    double by_place = 0;         ///< 1 where start and object agree, falling with their distance
    double by_place_and_turn = 0;
  };
  Likeness Compare(const FrameSituation& a, const FrameSituation& b) const;
  static double Similarity(const Likeness& likeness, const FrameGains& gains);
  static Eigen::Matrix3d Covariance(const Likeness& likeness, const FrameGains& gains);
  PartedCovariance Parted(const std::vector<int>& chosen, const FrameGains& gains) const;
  void Fit(const std::vector<FrameGains>& grid, Eigen::MatrixXd values);

  int target_ = -1;
  bool turns_ = false;   // the target's orientation is known
  double length_m_ = 1;  // mean distance from start to object: the unit of lengths
  Eigen::Vector3d mean_start_ = Eigen::Vector3d::Zero();
  std::vector<FrameSituation> situations_;
  struct Member {
    FrameGains gains;
    double share = 0;
    BlockKriging kriging;
    Streams inverse;  // kriging's, for queries; empty where the trials are many
  };
  std::vector<Member> members_;
  Eigen::MatrixXd left_out_;  // 3n x frames: x - O as the others predict it
  Eigen::VectorXd left_out_distance_m_;
  Eigen::VectorXd left_out_spread_;  // one a trial
  Streams paths_;                    // x - O, a coordinate of a trial a column
  Streams noise_;                    // variance of each member's noise at each frame (m^2)
  Eigen::VectorXd start_share_;
};

}  // namespace exemplar::learning
