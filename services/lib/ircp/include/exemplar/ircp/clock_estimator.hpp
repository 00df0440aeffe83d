#pragma once
#include <deque>
#include <optional>

#include "exemplar/ircp/clock_relation.hpp"

namespace exemplar::ircp {

/// One two-way exchange of stamps, as in NTP (RFC 5905, section 8).
struct ClockExchange {
  Stamp sent;            ///< the question, on our clock
  Stamp their_received;  ///< on theirs
  Stamp their_sent;      ///< the answer, on theirs
  Stamp received;        ///< on ours

  /// Their clock minus ours, were both ways equally long.
  Duration offset() const { return (their_received - sent) / 2 + (their_sent - received) / 2; }
  /// Spent on the way; the true offset lies within half of it.
  Duration delay() const { return (received - sent) - (their_sent - their_received); }
  Stamp middle() const { return sent + (received - sent) / 2; }
};

/// Follows one clock from exchanges: a line through the offsets of the last minutes, in which an
/// exchange counts the less the longer it took beyond the quickest one. A jump shows where the
/// bounds of an exchange exclude what went before; it begins a new epoch. Thread-compatible.
class ClockEstimator {
 public:
  /// The size of the jump where the clock has jumped since the exchange before. Exchanges that took
  /// longer than a second, or a negative time, or have stamps of another century, are left out.
  std::optional<Duration> Add(const ClockExchange& exchange);
  /// Our own clock has jumped: what was measured before says nothing any more.
  void StartEpoch(Stamp since);

  /// Fills in all but the names. nullopt before the first exchange of an epoch.
  std::optional<ClockRelation> RelationAt(Stamp now) const;
  std::uint64_t exchanges() const { return exchanges_; }
  /// Of this epoch, as far as they are remembered.
  std::size_t remembered() const { return window_.size(); }

 private:
  struct Line {
    double offset_s = 0;  ///< beside the newest exchange's, at its time
    double drift = 0;
    double drift_error = 0;
  };
  Line Fit() const;
  /// Whether what is remembered proves that the clock has jumped since.
  bool IsExcluded(const ClockExchange& exchange) const;

  std::deque<ClockExchange> window_;
  std::uint64_t exchanges_ = 0;
  int epoch_ = 0;
  Stamp since_;
};

}  // namespace exemplar::ircp
