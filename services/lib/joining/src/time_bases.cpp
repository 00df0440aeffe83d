#include "time_bases.hpp"

#include <optional>
#include <utility>

namespace exemplar::joining {
namespace {

using ircp::ClockTrack;

const ClockTrack* Find(const Facts& facts, const std::string& participant) {
  const auto found = facts.clocks.find(participant);
  return found == facts.clocks.end() || participant.empty() ? nullptr : &found->second;
}

const std::string& ProgramOf(const ClockTrack& track) { return track.relations().back().program; }

Stamp After(const ClockTrack& track, Stamp time) { return time + track.OffsetAt(time); }

/// `a` sees the clock of `b`, or of a program that `b` sees as well: from b's clock to a's.
std::optional<TimeBase> Surest(const Facts& a, const Facts& b) {
  std::optional<TimeBase> best;
  const auto offer = [&](TimeBase base, bool differs) {
    if (best && best->uncertainty <= base.uncertainty) return;
    if (!differs) {
      base.to_first = base.from_first = [](Stamp time) { return time; };
    }
    best = std::move(base);
  };
  if (!a.observer.empty() && a.observer == b.observer) return TimeBase{};
  if (const ClockTrack* track = Find(a, b.observer)) {
    offer({.to_first = [track](Stamp t) { return track->ToObserver(t); },
           .from_first = [track](Stamp t) { return After(*track, t); },
           .uncertainty = track->uncertainty(),
           .through = ProgramOf(*track)},
          track->Differs());
  }
  if (const ClockTrack* track = Find(b, a.observer)) {
    offer({.to_first = [track](Stamp t) { return After(*track, t); },
           .from_first = [track](Stamp t) { return track->ToObserver(t); },
           .uncertainty = track->uncertainty(),
           .through = ProgramOf(*track)},
          track->Differs());
  }
  for (const auto& [participant, of_a] : a.clocks) {
    const ClockTrack* in_a = &of_a;
    const ClockTrack* in_b = Find(b, participant);
    if (in_b == nullptr) continue;
    offer({.to_first = [in_a, in_b](Stamp t) { return in_a->ToObserver(After(*in_b, t)); },
           .from_first = [in_a, in_b](Stamp t) { return in_b->ToObserver(After(*in_a, t)); },
           .uncertainty = in_a->uncertainty() + in_b->uncertainty(),
           .through = ProgramOf(*in_a)},
          in_a->Differs() || in_b->Differs());
  }
  return best;
}

/// First by `b_to_a`, then by `a_to_first`.
TimeBase Chain(const TimeBase& a_to_first, const TimeBase& b_to_a) {
  return {
      .to_first = [a_to_first, b_to_a](Stamp t) { return a_to_first.to_first(b_to_a.to_first(t)); },
      .from_first = [a_to_first,
                     b_to_a](Stamp t) { return b_to_a.from_first(a_to_first.from_first(t)); },
      .uncertainty = a_to_first.uncertainty + b_to_a.uncertainty,
      .through = b_to_a.through};
}

}  // namespace

Result<std::vector<TimeBase>> RelateToFirst(std::span<const Facts> files, bool same_clock) {
  std::vector<std::optional<TimeBase>> bases(files.size());
  bases[0] = TimeBase{};
  // Each round takes the file that is surest; ties go to the order of the files.
  while (true) {
    std::size_t next = 0;
    std::optional<TimeBase> best;
    for (std::size_t b = 1; b < files.size(); ++b) {
      if (bases[b]) continue;
      for (std::size_t a = 0; a < files.size(); ++a) {
        if (!bases[a]) continue;
        const std::optional<TimeBase> step = Surest(files[a], files[b]);
        if (!step) continue;
        TimeBase chained = Chain(*bases[a], *step);
        if (best && best->uncertainty <= chained.uncertainty) continue;
        best = std::move(chained);
        next = b;
      }
    }
    if (!best) break;
    bases[next] = std::move(best);
  }
  std::vector<TimeBase> found;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!bases[i] && !same_clock) {
      return FailedPrecondition(
          files[i].name + ": nothing relates its recorder's clock to that of " + files[0].name +
              ": neither recorder saw the other one or a program that the other saw, too "
              "(metadata exemplar.clock); --same-clock takes the two clocks for one",
          "FILE");
    }
    found.push_back(bases[i] ? std::move(*bases[i]) : TimeBase{});
  }
  return found;
}

}  // namespace exemplar::joining
