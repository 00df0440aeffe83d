#pragma once
// Four numbers at a time, and functions compiled twice: for any processor, and for those with AVX2
// and FMA, chosen when the program runs. The project is built without -march: Eigen's alignment
// would differ between its files and the packaged libraries.

#include <array>
#include <cstddef>
#include <cstring>

namespace exemplar::geometry {

/// Four doubles that the compiler keeps in one register or in two, as the target allows.
typedef double Four __attribute__((vector_size(32)));

#define EXEMPLAR_INLINE inline __attribute__((always_inline))
#if defined(__x86_64__)
#define EXEMPLAR_WIDE __attribute__((target("avx2,fma")))
#else
#define EXEMPLAR_WIDE
#endif

/// Whether functions marked EXEMPLAR_WIDE may run here.
inline bool HasWide() {
#if defined(__x86_64__)
  static const bool has = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return has;
#else
  return true;
#endif
}

EXEMPLAR_INLINE void Load(const double* from, Four& to) { std::memcpy(&to, from, sizeof(Four)); }
EXEMPLAR_INLINE void Store(const Four& from, double* to) { std::memcpy(to, &from, sizeof(Four)); }

/// False for what is not a number, too.
EXEMPLAR_INLINE bool AllAtMost(const Four& a, double bound) {
  return a[0] <= bound && a[1] <= bound && a[2] <= bound && a[3] <= bound;
}

template <std::size_t N>
EXEMPLAR_INLINE void Polynomial(const std::array<double, N>& series, const Four& x, Four& value) {
  value = Four{} + series[N - 1];
  for (std::size_t k = N - 1; k-- > 0;) value = value * x + series[k];
}

/// Taylor series of cos(a) (`first` 0) and sin(a) / a (`first` 1) in a^2.
constexpr std::array<double, 13> CircularSeries(int first) {
  std::array<double, 13> series = {1.0};
  double factorial = 1;
  for (std::size_t k = 1; k < series.size(); ++k) {
    const double n = 2 * static_cast<double>(k) + first;
    factorial *= n * (n - 1);
    series[k] = (k % 2 == 0 ? 1 : -1) / factorial;
  }
  return series;
}
/// Up to this angle their sums are exact to rounding.
constexpr double kLargestSeriesAngle = 1.5707963267948966;

/// cos(a) and sin(a) / a from a^2, for a up to kLargestSeriesAngle.
EXEMPLAR_INLINE void CosineAndSinc(const Four& squared, Four& cosine, Four& sinc) {
  constexpr std::array<double, 13> kCosine = CircularSeries(0);
  constexpr std::array<double, 13> kSinc = CircularSeries(1);
  Polynomial(kCosine, squared, cosine);
  Polynomial(kSinc, squared, sinc);
}

struct FourQuaternions {
  Four x, y, z, w;
};

EXEMPLAR_INLINE void Multiply(const FourQuaternions& a, const FourQuaternions& b,
                              FourQuaternions& c) {
  c.w = a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z;
  c.x = a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y;
  c.y = a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x;
  c.z = a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w;
}

}  // namespace exemplar::geometry
