#include "clock_repair.hpp"

#include <algorithm>
#include <cmath>

#include "csv_text.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::demonstration {
namespace {

/// Later than year 2096 as a Unix time: then the column is not in seconds.
constexpr double kLatest_s = 4e9;
constexpr std::size_t kRowsPerBackwardRow = 50;

/// Counts mended rows and remembers the first.
struct Tally {
  std::size_t count = 0;
  std::size_t first_row = 0;
  void Add(std::size_t row) {
    if (count++ == 0) first_row = row;
  }
};

double MedianStep(const std::vector<double>& time_s) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < time_s.size(); ++i) {
    if (time_s[i] > time_s[i - 1]) steps.push_back(time_s[i] - time_s[i - 1]);
  }
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Gives the rows of each stall times between its tick and the next one.
void SpreadStalls(std::vector<double>& time_s, const std::vector<std::size_t>& rows, double step,
                  Tally& stalled) {
  std::size_t first = 0;
  while (first < time_s.size()) {
    std::size_t next = first + 1;
    while (next < time_s.size() && time_s[next] == time_s[first]) ++next;
    if (next - first > 1) {
      const double span = next < time_s.size() ? time_s[next] - time_s[first]
                                               : step * static_cast<double>(next - first);
      const double start = time_s[first];
      for (std::size_t i = first + 1; i < next; ++i) {
        time_s[i] =
            start + span * static_cast<double>(i - first) / static_cast<double>(next - first);
        stalled.Add(rows[i]);
      }
    }
    first = next;
  }
}

}  // namespace

Result<RepairedClock> RepairClock(const std::vector<double>& time_s,
                                  const std::vector<bool>& repeats_previous,
                                  const std::vector<std::size_t>& lines, std::string_view source) {
  RepairedClock repaired;
  Tally without_time, repeated, backward, stalled;
  double backward_from = 0;
  double backward_to = 0;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    const double t = time_s[i];
    if (!std::isfinite(t)) {
      without_time.Add(i);
      continue;
    }
    if (std::abs(t) > kLatest_s) {
      return InvalidArgument(Place(source, lines[i]) + "time_s: " + FormatDouble(t) +
                                 " s is no time of a trial; the column must be in seconds",
                             "time_s");
    }
    if (repaired.time_s.empty() || t > repaired.time_s.back()) {
      repaired.rows.push_back(i);
      repaired.time_s.push_back(t);
      continue;
    }
    if (t == repaired.time_s.back()) {
      if (repeats_previous[i]) {
        repeated.Add(i);
      } else {
        repaired.rows.push_back(i);
        repaired.time_s.push_back(t);
      }
      continue;
    }
    if (backward.count == 0) {
      backward_from = repaired.time_s.back();
      backward_to = t;
    }
    backward.Add(i);
    const std::size_t kept = repaired.time_s.size();
    if (kept >= 2 && t > repaired.time_s[kept - 2]) {
      // The row before was the odd one out: it ran ahead of both its neighbours.
      repaired.rows.back() = i;
      repaired.time_s.back() = t;
    }
  }

  const std::string name(source);
  const auto where = [&](const Tally& tally) {
    return " (first at line " + std::to_string(lines[tally.first_row]) + ")";
  };
  const std::size_t allowed = std::max<std::size_t>(1, time_s.size() / kRowsPerBackwardRow);
  if (backward.count > allowed) {
    return InvalidArgument(
        Place(source, lines[backward.first_row]) + "time_s: time runs back from " +
            FormatDouble(backward_from) + " s to " + FormatDouble(backward_to) + " s, and " +
            std::to_string(backward.count) + " of " + std::to_string(time_s.size()) +
            " rows lie behind an earlier one; does the file hold two trials?",
        "time_s");
  }
  if (without_time.count > allowed) {
    return InvalidArgument(
        Place(source, lines[without_time.first_row]) + "time_s: no finite time here and in " +
            std::to_string(without_time.count) + " of " + std::to_string(time_s.size()) + " rows",
        "time_s");
  }
  if (repaired.time_s.size() < 2 || repaired.time_s.back() == repaired.time_s.front()) {
    const std::size_t line = repaired.rows.empty() ? lines.front() : lines[repaired.rows.front()];
    return InvalidArgument(
        Place(source, line) + "time_s: " +
            (repaired.time_s.empty()
                 ? std::string("no row has a finite time")
                 : "all rows have the time " + FormatDouble(repaired.time_s.front()) + " s") +
            "; a trial needs two samples at different times",
        "time_s");
  }

  SpreadStalls(repaired.time_s, repaired.rows, MedianStep(repaired.time_s), stalled);
  const auto notice = [&](const Tally& tally, const std::string& text) {
    if (tally.count > 0) {
      repaired.notices.push_back(name + ": time_s: " + std::to_string(tally.count) + " row(s) " +
                                 text + where(tally));
    }
  };
  notice(without_time, "without a finite time were left out");
  notice(repeated, "that repeat the row before were left out");
  notice(backward, "where time runs back or jumps ahead were left out");
  notice(stalled, "where the clock stalls were spread evenly up to its next tick");

  repaired.first_s = repaired.time_s.front();
  if (repaired.first_s != 0) {
    for (double& t : repaired.time_s) t -= repaired.first_s;
    repaired.notices.push_back(name + ": time_s starts at " + FormatDouble(repaired.first_s) +
                               " s; times are counted from there");
  }
  return repaired;
}

}  // namespace exemplar::demonstration
