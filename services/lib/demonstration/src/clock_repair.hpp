#pragma once
// Mends the time column of a recording: real clocks stall, repeat and glitch.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::demonstration {

/// Rows to keep, and their strictly increasing times.
struct RepairedClock {
  std::vector<std::size_t> rows;
  std::vector<double> time_s;  ///< one a kept row; the first is 0
  double first_s = 0;          ///< the first time as it stood in the file
  std::vector<std::string> notices;
};

/// What is mended, each with a notice that counts it and names its first line:
/// - a row without a finite time, or that repeats the row before it in every value, is dropped;
/// - times that stall (rows that differ, one time) are spread evenly up to the next tick;
/// - a row whose time runs back, or that jumped ahead of its followers, is dropped, as long as such
///   rows are at most one in fifty (and one at least).
/// More than that is an Error with the first line: the file may hold two trials.
/// `repeats_previous[i]`: row i equals row i - 1 in every value.
Result<RepairedClock> RepairClock(const std::vector<double>& time_s,
                                  const std::vector<bool>& repeats_previous,
                                  const std::vector<std::size_t>& lines, std::string_view source);

}  // namespace exemplar::demonstration
