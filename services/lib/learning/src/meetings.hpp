#pragma once
// Where a tool meets an object without touch being measured: a trial goes in, rests or turns back,
// and goes out or ends there.

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace exemplar::learning {

/// A stay of one trial: frames of its own time, first <= still <= last.
struct Stay {
  int first = 0;  ///< onset of rest
  int still = 0;  ///< where it rests most
  int last = 0;   ///< the last frame before it leaves
};

/// A trial's tool path in an object's frame (its origin is the object), n x 3, evenly spaced.
using RelativePath = Eigen::MatrixXd;

/// Stays to which the path came from further away, and from which it turned back (or where it
/// ended), in time order. The rest before the first motion is none.
std::vector<Stay> FindStays(const RelativePath& path);

/// A meeting that the trials have in common: one stay a trial.
struct Meeting {
  std::vector<Stay> stays;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< mean, in the frame that brings them closest
  double spread_m = 0;                              ///< about the mean
  bool turns = false;                               ///< that frame turns with the object
};

/// One trial as the matching sees it. `turned` is empty where the object has no orientation.
struct MeetingTrial {
  RelativePath shifted;  ///< tool minus object, base axes
  RelativePath turned;   ///< in the object's axes
};

/// The stays at a consistent place near the object, matched over the trials in time order. Where
/// most trials have further stays between two meetings (strokes, in numbers of their own), the
/// whole is one long meeting.
std::vector<Meeting> FindMeetings(std::span<const MeetingTrial> trials);

}  // namespace exemplar::learning
