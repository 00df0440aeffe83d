#pragma once
// Seeded randomness, the same on every machine (std:: distributions are not).

#include <cstdint>

namespace exemplar {

/// xoshiro256** seeded by splitmix64 (Blackman & Vigna 2018). Thread-compatible.
class Rng {
 public:
  explicit Rng(std::uint64_t seed);
  std::uint64_t NextBits();
  /// Uniform in [0, 1).
  double Uniform();
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  /// Uniform in {0, ..., n - 1}. Precondition: n > 0.
  std::uint64_t Below(std::uint64_t n);
  /// Standard normal (Box-Muller).
  double Normal();
  double Normal(double mean, double deviation) { return mean + deviation * Normal(); }
  /// An independent generator for a named part, so that adding draws in one part does not move
  /// another.
  Rng Fork(std::uint64_t stream) const;

 private:
  std::uint64_t state_[4];
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace exemplar
