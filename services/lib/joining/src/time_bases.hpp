#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "facts.hpp"

namespace exemplar::joining {

/// From a file's clock to the first file's, and back.
struct TimeBase {
  std::function<Stamp(Stamp)> to_first = [](Stamp time) { return time; };
  std::function<Stamp(Stamp)> from_first = [](Stamp time) { return time; };
  Duration uncertainty{0};
  std::string through = "the same clock";
};

/// One for each file, by the surest of the measured ways, over other files where there is none to
/// the first. The facts must outlive the result.
Result<std::vector<TimeBase>> RelateToFirst(std::span<const Facts> files, bool same_clock);

}  // namespace exemplar::joining
