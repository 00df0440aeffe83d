#include "recorder/clock_marks.hpp"

#include <algorithm>

namespace exemplar::recorder {
namespace {

constexpr Duration kFirstInterval = std::chrono::seconds(1);
constexpr Duration kLongestInterval = std::chrono::minutes(1);

}  // namespace

void ClockMarks::Reset() { part_ = -1; }

Status ClockMarks::WriteIfDue(PartFiles& file, Duration steady_now) {
  if (file.part() != part_) {
    part_ = file.part();
    interval_ = kFirstInterval;
  } else if (steady_now < next_) {
    return {};
  } else {
    interval_ = std::min(2 * interval_, kLongestInterval);
  }
  next_ = steady_now + interval_;
  return Write(file);
}

Status ClockMarks::Write(PartFiles& file) {
  const Duration correction = correction_();
  std::vector<ircp::ClockRelation> relations = clocks_();
  if (correction_() != correction) return {};  // the clock was set meanwhile: at the next time
  for (ircp::ClockRelation& relation : relations) {
    relation.at = relation.at + correction;
    relation.since = relation.since + correction;
    relation.offset -= correction;
    if (const Status s = file.WriteMark("exemplar.clock", ircp::ToFields(relation)); !s.ok()) {
      return s;
    }
  }
  return {};
}

}  // namespace exemplar::recorder
