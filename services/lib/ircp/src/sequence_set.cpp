#include "exemplar/ircp/sequence_set.hpp"

#include <algorithm>
#include <iterator>

namespace exemplar::ircp {

bool SequenceSet::Insert(std::uint64_t seq) {
  auto after = intervals_.upper_bound(seq);
  const auto before = after == intervals_.begin() ? intervals_.end() : std::prev(after);
  if (before != intervals_.end() && seq <= before->second) return false;

  const bool joins_before = before != intervals_.end() && before->second + 1 == seq;
  const bool joins_after = after != intervals_.end() && seq + 1 == after->first;
  if (joins_before) {
    before->second = joins_after ? after->second : seq;
    if (joins_after) intervals_.erase(after);
  } else if (joins_after) {
    const std::uint64_t last = after->second;
    after = intervals_.erase(after);
    intervals_.emplace_hint(after, seq, last);
  } else {
    intervals_.emplace_hint(after, seq, seq);
  }
  lowest_ = received_ == 0 ? seq : std::min(lowest_, seq);
  highest_ = std::max(highest_, seq);
  ++received_;

  if (intervals_.size() > kMaxGaps + 1) {
    const auto lowest = intervals_.begin();
    const auto next = std::next(lowest);
    lowest->second = next->second;
    intervals_.erase(next);
  }
  return true;
}

}  // namespace exemplar::ircp
