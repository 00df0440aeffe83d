#pragma once
// How the clocks of two programs stand to each other: measured, kept in recordings, applied.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"

namespace exemplar::ircp {

/// Between 1970 and 2115: differences of two such stamps, and sums of those, are numbers.
bool IsOfOurTime(Stamp stamp);

/// The part of a writer's identity that all endpoints of one program share.
std::string ParticipantOf(const std::string& writer);

/// Another program's clock as one program (the observer) saw it at one moment.
struct ClockRelation {
  std::string participant{};  ///< whose clock
  std::string program{};
  std::string observer{};   ///< the participant that measured
  Stamp at{};               ///< on the observer's clock
  Duration offset{0};       ///< the clock minus the observer's, at `at`
  double drift = 0;         ///< seconds a second, by which the offset grows
  Duration uncertainty{0};  ///< the offset lies within so much of the truth
  std::uint64_t exchanges = 0;
  int epoch = 0;  ///< how often one of the two clocks had jumped before
  Stamp since{};  ///< begin of the epoch, on the observer's clock
};

/// As a recording's metadata "exemplar.clock" has it; the stamps in nanoseconds.
std::map<std::string, std::string> ToFields(const ClockRelation& relation);
/// The error names the field.
Result<ClockRelation> ClockRelationFromFields(const std::map<std::string, std::string>& fields);

/// What is known of one clock over a recording. Thread-compatible.
class ClockTrack {
 public:
  /// In any order; relations of one clock and one observer.
  void Add(ClockRelation relation);
  bool empty() const { return relations_.empty(); }
  const std::vector<ClockRelation>& relations() const { return relations_; }

  /// The clock minus the observer's at `observer_time`: between two relations of an epoch on the
  /// line that joins them, elsewhere along the nearest one's drift. Precondition: not empty.
  Duration OffsetAt(Stamp observer_time) const;
  /// What the observer's clock showed when this one showed `time`. Preconditions: not empty, and
  /// IsOfOurTime(time).
  Stamp ToObserver(Stamp time) const;
  /// The best known.
  Duration uncertainty() const;
  /// Whether the two clocks certainly differ; where not, they are taken for the same.
  bool Differs() const;

 private:
  std::vector<ClockRelation> relations_;  ///< in order of `at`
};

}  // namespace exemplar::ircp
