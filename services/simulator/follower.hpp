#pragma once
// What the robot's servos are told at each moment, made of the samples that arrive now and then.

#include <Eigen/Core>
#include <deque>
#include <string>
#include <vector>

#include "exemplar/base/stamp.hpp"
#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::simulator {

/// One sample, mapped onto the chain's joints.
struct Setpoint {
  Eigen::VectorXd positions;
  Eigen::VectorXd velocities;  ///< empty: taken from the samples' differences
  Stamp stamp;                 ///< by the sender's clock
  std::uint64_t seq = 0;
};

struct FollowerOptions {
  /// Without a sample for so long (or for its own validity, where it has one) the robot holds.
  Duration patience = std::chrono::milliseconds(250);
  /// How far behind the sender a stream is played that must be smooth rather than prompt, so that
  /// there is a later sample to move towards.
  Duration playback_delay = std::chrono::milliseconds(25);
};

/// Thread-compatible. Times are those of one steady clock and never go back. Positions stay within
/// limits and move no faster than the joints' speed limits.
class Follower {
 public:
  enum class Mode { kHolding, kFollowing, kGoingHome };
  struct Output {
    Eigen::VectorXd positions;
    Eigen::VectorXd velocities;
  };

  /// Holds `start` at first.
  Follower(std::vector<kinematics::JointLimits> limits, const Eigen::VectorXd& start,
           FollowerOptions options = {});

  /// Prompt following (joint commands): between samples the motion goes on at the sample's speed.
  /// `validity` 0: options.patience.
  void Command(Duration now, Setpoint setpoint, Duration validity);
  /// Smooth following (a person's suit): interpolates, options.playback_delay late.
  void Stream(Duration now, Setpoint setpoint);
  /// Moves to `target` along a minimum-jerk path at half the joints' speed limits, unless a sample
  /// comes; returns how long it takes.
  Duration GoTo(Duration now, const Eigen::VectorXd& target);
  /// Holds `positions` from now on; nothing moves there gently.
  void HoldAt(const Eigen::VectorXd& positions);

  Output At(Duration now);
  /// What At returned last.
  const Output& last() const { return last_; }
  Mode mode() const { return mode_; }
  /// Number of the last sample that was acted on; 0: none yet.
  std::uint64_t acted_seq() const { return acted_seq_; }
  /// How often samples stopped coming.
  int stale_count() const { return stale_count_; }

 private:
  struct Timed {
    Duration received{0};
    Setpoint setpoint;
  };
  Output Raw(Duration now);
  Output Extrapolated(Duration now) const;
  Output Interpolated(Duration now);
  Output OnTheWayHome(Duration now);
  void Hold();

  std::vector<kinematics::JointLimits> limits_;
  FollowerOptions options_;
  Mode mode_ = Mode::kHolding;
  bool smooth_ = false;
  Duration validity_{0};
  std::deque<Timed> samples_;   ///< the last few, oldest first
  Duration stamp_to_local_{0};  ///< smallest reception minus stamp of this stream
  Eigen::VectorXd way_start_, way_end_;
  Duration way_begin_{0}, way_length_{0};
  std::uint64_t acted_seq_ = 0;
  int stale_count_ = 0;
  Duration last_now_{0};
  bool started_ = false;
  Output last_;
};

}  // namespace exemplar::simulator
