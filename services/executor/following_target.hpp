#pragma once
// Where a moving object is and will be, by what is seen of it.

#include <Eigen/Core>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "exemplar/base/stamp.hpp"
#include "exemplar/geometry/pose.hpp"

namespace exemplar::executor {

/// An object's path: straight on at one speed, and back again where it was seen to turn. Times are
/// those of one steady clock. Thread-compatible.
class TargetTrack {
 public:
  /// A measured position and the standard deviation of that, in the order of time.
  void Add(Duration time, const Eigen::Vector3d& base_p_object, double sigma_m);

  bool empty() const { return samples_.empty(); }
  Duration last_seen() const { return samples_.back().time; }
  /// Precondition of the following: not empty().
  /// Now, or within a few seconds of now: straight on, turning where it turned before.
  Eigen::Vector3d PositionAt(Duration time) const;
  Eigen::Vector3d VelocityAt(Duration time) const;
  /// Metres a second; 0 where what is seen is no more than noise.
  double speed() const { return velocity_.norm(); }
  /// Whether it is about to turn between these times, as far as it was seen to turn.
  bool TurnsWithin(Duration begin, Duration end) const;
  /// Where it turned so far: its way lies between these, along its direction of motion.
  int turning_points() const { return (low_ ? 1 : 0) + (high_ ? 1 : 0); }

 private:
  struct Sample {
    Duration time{0};
    Eigen::Vector3d base_p = Eigen::Vector3d::Zero();
    double sigma_m = 0;
  };
  void Fit();
  void NoteTurn();
  Eigen::Vector3d StraightAt(Duration time) const;
  /// Along `along_`: of a position, and the way folded back between the turning points.
  double Along(const Eigen::Vector3d& base_p) const;
  double Folded(double along, bool* backwards) const;

  std::deque<Sample> samples_;  ///< of the present straight stretch, the last part of a second
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();  ///< at origin_
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
  Duration origin_{0};
  bool is_known_ = false;  ///< whether it moves, and how fast
  int strays_ = 0;         ///< of the last samples, that do not fit the stretch
  // The line it goes to and fro on, once it turned.
  Eigen::Vector3d along_ = Eigen::Vector3d::Zero();  ///< unit; zero: it never turned
  Eigen::Vector3d base_p_line_ = Eigen::Vector3d::Zero();
  std::optional<double> low_, high_;
};

/// The tracks of all objects. Thread-safe.
class TargetTracks {
 public:
  void Add(const std::string& name, Duration time, const geometry::Pose& base_T_object,
           double sigma_m);
  /// As it is now, with the last measured orientation.
  std::optional<std::pair<TargetTrack, geometry::Pose>> Find(const std::string& name) const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::pair<TargetTrack, geometry::Pose>> tracks_;
};

}  // namespace exemplar::executor
