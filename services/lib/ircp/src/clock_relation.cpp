#include "exemplar/ircp/clock_relation.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "exemplar/base/text.hpp"

namespace exemplar::ircp {
namespace {

using Fields = std::map<std::string, std::string>;

/// Faster than any clock drifts.
constexpr double kAbsurdDrift = 0.1;

Duration AlongDrift(const ClockRelation& relation, Stamp observer_time) {
  const double seconds = ToSeconds(observer_time - relation.at);
  return relation.offset + Duration(std::llround(relation.drift * seconds * 1e9));
}

Result<std::string> Text(const Fields& fields, const char* name) {
  const auto found = fields.find(name);
  if (found == fields.end()) return Error{ErrorCode::kDataLoss, std::string(name) + " is missing"};
  return found->second;
}

Result<std::int64_t> Whole(const Fields& fields, const char* name) {
  const Result<std::string> text = Text(fields, name);
  if (!text.ok()) return text.error();
  const std::optional<long long> number = ParseInteger(*text);
  if (!number) {
    return Error{ErrorCode::kDataLoss,
                 std::string(name) + ": \"" + *text + "\" is not a whole number"};
  }
  return static_cast<std::int64_t>(*number);
}

}  // namespace

bool IsOfOurTime(Stamp stamp) {
  constexpr std::int64_t kEnd = std::int64_t{1} << 62;
  return stamp >= Stamp() && stamp < Stamp::FromNanoseconds(kEnd);
}

std::string ParticipantOf(const std::string& writer) { return writer.substr(0, writer.find('|')); }

Fields ToFields(const ClockRelation& relation) {
  return {{"participant", relation.participant},
          {"program", relation.program},
          {"observer", relation.observer},
          {"at_ns", std::to_string(relation.at.nanoseconds())},
          {"offset_ns", std::to_string(relation.offset.count())},
          {"drift_ppm", FormatDouble(relation.drift * 1e6)},
          {"uncertainty_ns", std::to_string(relation.uncertainty.count())},
          {"exchanges", std::to_string(relation.exchanges)},
          {"jumps", std::to_string(relation.epoch)},
          {"since_ns", std::to_string(relation.since.nanoseconds())}};
}

Result<ClockRelation> ClockRelationFromFields(const Fields& fields) {
  ClockRelation relation;
  for (const auto& [name, member] : {std::pair{"participant", &ClockRelation::participant},
                                     std::pair{"program", &ClockRelation::program},
                                     std::pair{"observer", &ClockRelation::observer}}) {
    Result<std::string> text = Text(fields, name);
    if (!text.ok()) return text.error();
    relation.*member = std::move(*text);
  }
  const Result<std::int64_t> at = Whole(fields, "at_ns");
  const Result<std::int64_t> offset = Whole(fields, "offset_ns");
  const Result<std::int64_t> uncertainty = Whole(fields, "uncertainty_ns");
  const Result<std::int64_t> exchanges = Whole(fields, "exchanges");
  const Result<std::int64_t> jumps = Whole(fields, "jumps");
  const Result<std::int64_t> since = Whole(fields, "since_ns");
  for (const auto* number : {&at, &offset, &uncertainty, &exchanges, &jumps, &since}) {
    if (!number->ok()) return number->error();
  }
  const Result<std::string> drift = Text(fields, "drift_ppm");
  if (!drift.ok()) return drift.error();
  const std::optional<double> ppm = ParseDouble(*drift);
  if (!ppm || !(std::abs(*ppm) < kAbsurdDrift * 1e6)) {
    return Error{ErrorCode::kDataLoss, "drift_ppm: \"" + *drift + "\" is no clock's drift"};
  }
  if (*uncertainty < 0 || *jumps < 0 || *jumps > 1'000'000'000 || *exchanges < 0) {
    return Error{ErrorCode::kDataLoss, "uncertainty_ns, jumps or exchanges is negative"};
  }
  relation.at = Stamp::FromNanoseconds(*at);
  relation.since = Stamp::FromNanoseconds(*since);
  const Stamp theirs = Stamp::FromNanoseconds(*offset < 0 ? -(*offset + 1) : *offset);
  if (!IsOfOurTime(relation.at) || !IsOfOurTime(relation.since) || !IsOfOurTime(theirs)) {
    return Error{ErrorCode::kDataLoss, "at_ns, since_ns or offset_ns is of no time of ours"};
  }
  relation.offset = Duration(*offset);
  relation.drift = *ppm * 1e-6;
  relation.uncertainty = Duration(*uncertainty);
  relation.exchanges = static_cast<std::uint64_t>(*exchanges);
  relation.epoch = static_cast<int>(*jumps);
  return relation;
}

void ClockTrack::Add(ClockRelation relation) {
  const auto after = std::upper_bound(relations_.begin(), relations_.end(), relation,
                                      [](const ClockRelation& a, const ClockRelation& b) {
                                        return std::pair(a.epoch, a.at) < std::pair(b.epoch, b.at);
                                      });
  relations_.insert(after, std::move(relation));
}

Duration ClockTrack::OffsetAt(Stamp observer_time) const {
  // The last relation whose epoch has begun and that is not later; else the first of that epoch.
  std::size_t before = 0;
  for (std::size_t i = 0; i < relations_.size(); ++i) {
    const ClockRelation& relation = relations_[i];
    const bool begun = relation.since <= observer_time;
    const bool first_of_epoch = i == 0 || relations_[i - 1].epoch != relation.epoch;
    if (i == 0 || (begun && (relation.at <= observer_time || first_of_epoch))) before = i;
  }
  const ClockRelation& a = relations_[before];
  if (observer_time <= a.at || before + 1 == relations_.size()) {
    return AlongDrift(a, observer_time);
  }
  const ClockRelation& b = relations_[before + 1];
  if (b.epoch != a.epoch || b.at == a.at) return AlongDrift(a, observer_time);
  const double share = ToSeconds(observer_time - a.at) / ToSeconds(b.at - a.at);
  const double step_ns = static_cast<double>((b.offset - a.offset).count());
  return a.offset + Duration(std::llround(share * step_ns));
}

Stamp ClockTrack::ToObserver(Stamp time) const {
  // The offset hardly changes within itself, so that a few steps find the fixed point.
  constexpr int kSteps = 4;
  Stamp observer_time = time - relations_.front().offset;
  for (int step = 0; step < kSteps; ++step) observer_time = time - OffsetAt(observer_time);
  return observer_time;
}

Duration ClockTrack::uncertainty() const {
  Duration best = relations_.empty() ? Duration(0) : relations_.front().uncertainty;
  for (const ClockRelation& relation : relations_) best = std::min(best, relation.uncertainty);
  return best;
}

bool ClockTrack::Differs() const {
  return std::any_of(relations_.begin(), relations_.end(), [](const ClockRelation& relation) {
    return std::chrono::abs(relation.offset) > relation.uncertainty;
  });
}

}  // namespace exemplar::ircp
