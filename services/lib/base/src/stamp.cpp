#include "exemplar/base/stamp.hpp"

#include <cmath>
#include <cstdio>
#include <ctime>

namespace exemplar {

Stamp Stamp::FromSeconds(double seconds) { return FromNanoseconds(std::llround(seconds * 1e9)); }

Duration FromSeconds(double seconds) { return Duration(std::llround(seconds * 1e9)); }

std::string ToIso8601(Stamp stamp) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  std::int64_t whole = stamp.nanoseconds() / kSecond;
  std::int64_t rest = stamp.nanoseconds() % kSecond;
  if (rest < 0) {
    rest += kSecond;
    --whole;
  }
  const std::time_t seconds = whole;
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[64];
  const std::size_t n = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc);
  std::snprintf(text + n, sizeof text - n, ".%06dZ", static_cast<int>(rest / 1000));
  return text;
}

}  // namespace exemplar
