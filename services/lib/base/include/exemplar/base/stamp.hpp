#pragma once
// Time as a type. A raw integer of nanoseconds exists only on the wire.

#include <chrono>
#include <compare>
#include <cstdint>
#include <string>

namespace exemplar {

using Duration = std::chrono::nanoseconds;

/// A point in time on a source's wall clock: nanoseconds since the Unix epoch.
/// In simulation the same type counts from the simulation's own epoch.
class Stamp {
 public:
  constexpr Stamp() = default;
  static constexpr Stamp FromNanoseconds(std::int64_t ns) { return Stamp(ns); }
  static Stamp FromSeconds(double seconds);

  constexpr std::int64_t nanoseconds() const { return ns_; }
  double seconds() const { return static_cast<double>(ns_) * 1e-9; }

  friend constexpr auto operator<=>(Stamp, Stamp) = default;
  friend constexpr Duration operator-(Stamp a, Stamp b) { return Duration(a.ns_ - b.ns_); }
  friend constexpr Stamp operator+(Stamp a, Duration d) { return Stamp(a.ns_ + d.count()); }
  friend constexpr Stamp operator-(Stamp a, Duration d) { return Stamp(a.ns_ - d.count()); }

 private:
  constexpr explicit Stamp(std::int64_t ns) : ns_(ns) {}
  std::int64_t ns_ = 0;
};

/// Rounds to the nearest nanosecond. Precondition: |seconds| < 9e9.
Duration FromSeconds(double seconds);
inline double ToSeconds(Duration d) { return static_cast<double>(d.count()) * 1e-9; }

/// "2026-11-22T03:24:33.123456Z".
std::string ToIso8601(Stamp stamp);

}  // namespace exemplar
