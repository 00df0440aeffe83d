#include "pair_correlator.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "subsets.hpp"

namespace exemplar::learning {
namespace {

// Stretches remembered, powers of two: of few markers few stretches are alike, and of up to two
// none are, since all knots bear on each.
constexpr std::size_t kMemory = std::size_t{1} << 16;
constexpr std::size_t kMemoryOfFew = std::size_t{1} << 13;
constexpr std::size_t kFewMarkers = 4;
constexpr std::size_t kNoneAlike = 2;
constexpr double kConstant = 1e-12;  // variance of a warped signal of unit variance
constexpr std::uint16_t kStart = 0xFFFF;
constexpr std::uint16_t kEnd = 0xFFFE;

std::uint64_t Mix(std::uint64_t hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x9E3779B97F4A7C15u;
  return hash ^ (hash >> 29);
}

// A signal under the cubic that warps it on a stretch; the cubic's argument is the part of the
// stretch, its value counts samples.
struct WarpedSignal {
  const CorrelatedTrial::Sample* samples;
  double cubic[4];
};

// Points [first, behind) of the grid; point k lies at k * scale + shift of the stretch.
struct GridPart {
  int first, behind;
  double scale, shift;
};

typedef double Two __attribute__((vector_size(16)));
typedef double Four __attribute__((vector_size(32)));
typedef int FourInts __attribute__((vector_size(16)));

#define EXEMPLAR_INLINE inline __attribute__((always_inline))

EXEMPLAR_INLINE double ValueAt(const WarpedSignal& signal, double s) {
  const double* c = signal.cubic;
  const double place = c[0] + s * (c[1] + s * (c[2] + s * c[3]));
  const int at = static_cast<int>(place);
  return signal.samples[at].value + (place - at) * signal.samples[at].slope;
}

EXEMPLAR_INLINE void ValuesAt(const WarpedSignal& signal, const Four& s, Four& values) {
  const double* c = signal.cubic;
  const Four place = c[0] + s * (c[1] + s * (c[2] + s * c[3]));
  const FourInts at = __builtin_convertvector(place, FourInts);
  Two sample[4];
  for (int i = 0; i < 4; ++i) std::memcpy(&sample[i], &signal.samples[at[i]], sizeof(Two));
  const Four value = {sample[0][0], sample[1][0], sample[2][0], sample[3][0]};
  const Four slope = {sample[0][1], sample[1][1], sample[2][1], sample[3][1]};
  values = value + (place - __builtin_convertvector(at, Four)) * slope;
}

// Adds to the five sums: of a, b, aa, bb and ab.
EXEMPLAR_INLINE void AddPointsOf(const WarpedSignal& a, const WarpedSignal& b, const GridPart& part,
                                 double* sums) {
  Four in_lanes[5] = {};
  int k = part.first;
  for (; k + 4 <= part.behind; k += 4) {
    const Four point = {k + 0.0, k + 1.0, k + 2.0, k + 3.0};
    const Four s = point * part.scale + part.shift;
    Four va, vb;
    ValuesAt(a, s, va);
    ValuesAt(b, s, vb);
    in_lanes[0] += va;
    in_lanes[1] += vb;
    in_lanes[2] += va * va;
    in_lanes[3] += vb * vb;
    in_lanes[4] += va * vb;
  }
  for (int sum = 0; sum < 5; ++sum) {
    const Four& lanes = in_lanes[sum];
    sums[sum] += (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
  }
  for (; k < part.behind; ++k) {
    const double s = k * part.scale + part.shift;
    const double va = ValueAt(a, s);
    const double vb = ValueAt(b, s);
    sums[0] += va;
    sums[1] += vb;
    sums[2] += va * va;
    sums[3] += vb * vb;
    sums[4] += va * vb;
  }
}

void AddPoints(const WarpedSignal& a, const WarpedSignal& b, const GridPart& part, double* sums) {
  AddPointsOf(a, b, part, sums);
}
#if defined(__x86_64__)
__attribute__((target("avx2,fma"))) void AddPointsWide(const WarpedSignal& a, const WarpedSignal& b,
                                                       const GridPart& part, double* sums) {
  AddPointsOf(a, b, part, sums);
}
bool HasWideVectors() {
  static const bool has = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return has;
}
#else
void AddPointsWide(const WarpedSignal& a, const WarpedSignal& b, const GridPart& part,
                   double* sums) {
  AddPointsOf(a, b, part, sums);
}
bool HasWideVectors() { return false; }
#endif

}  // namespace

void PairCorrelator::Sums::Add(const Sums& other) {
  a += other.a;
  b += other.b;
  aa += other.aa;
  bb += other.bb;
  ab += other.ab;
}

CorrelatedTrial::CorrelatedTrial(const MarkerCandidates& trial)
    : time_s(trial.time_s),
      duration_s(trial.duration_s),
      samples_per_s(static_cast<double>(trial.signal.size() - 1) / trial.duration_s) {
  const Eigen::Index n = trial.signal.size();
  // Centred and scaled: r does not change, and the sums keep their digits.
  Eigen::VectorXd signal = trial.signal.array() - trial.signal.mean();
  const double deviation = std::sqrt(signal.squaredNorm() / static_cast<double>(n));
  const bool constant = !(deviation > kConstant * trial.signal.cwiseAbs().maxCoeff());
  signal *= constant ? 0 : 1 / deviation;
  samples.resize(static_cast<std::size_t>(n));
  for (Eigen::Index k = 0; k < n; ++k) {
    const double slope = k + 1 < n ? signal[k + 1] - signal[k] : 0;
    // The last has no slope, so that a place at the very end needs no care.
    samples[static_cast<std::size_t>(k)] = {signal[k], slope};
  }
}

PairCorrelator::PairCorrelator(const CorrelatedTrial& a, const CorrelatedTrial& b, int points,
                               double pairs)
    : points_(points), step_s_((a.duration_s + b.duration_s) / 2 / (points - 1)) {
  a_.trial = &a;
  b_.trial = &b;
  most_remembered_ =
      std::bit_ceil(static_cast<std::size_t>(std::clamp(4 * pairs, 16.0, 1.0 * kMemory)));
}

void PairCorrelator::Restart(std::size_t size) {
  const std::size_t knots = size + 2;
  for (Side* side : {&a_, &b_}) {
    side->own_s.assign(knots, 0);
    side->slope.assign(knots, 0);
    side->entering.assign(knots, 0);
    side->tangent.assign(knots, 0);
    side->name.assign(knots, kStart);
  }
  common_s_.assign(knots, 0);
  upto_.assign(knots, {});
  if (size > kNoneAlike && memory_.empty()) {
    memory_.resize(size > kFewMarkers ? most_remembered_
                                      : std::min(most_remembered_, kMemoryOfFew));
  }
}

void PairCorrelator::Limit(Side& side, std::size_t stretch, double next_tangent) {
  const double slope = side.slope[stretch];  // positive: markers are distinct
  const double entering = side.entering[stretch];
  const double squared = entering * entering + next_tangent * next_tangent;
  double scale = 1;
  if (squared > 9 * slope * slope) scale = 3 * slope / std::sqrt(squared);
  side.tangent[stretch] = scale * entering;
  side.entering[stretch + 1] = scale * next_tangent;
}

// A knot fixes the unlimited tangent of the one before, hence the limit of the second stretch
// behind, hence both tangents of the third.
void PairCorrelator::Push(std::size_t knot, double a_s, double b_s, std::uint16_t a_name,
                          std::uint16_t b_name) {
  a_.own_s[knot] = a_s;
  b_.own_s[knot] = b_s;
  a_.name[knot] = a_name;
  b_.name[knot] = b_name;
  common_s_[knot] = (a_s + b_s) / 2;
  const double per_width = 1 / (common_s_[knot] - common_s_[knot - 1]);
  for (Side* side : {&a_, &b_}) {
    side->slope[knot - 1] = (side->own_s[knot] - side->own_s[knot - 1]) * per_width;
    if (knot == 1) {
      side->entering[0] = side->slope[0];
    } else {
      Limit(*side, knot - 2, (side->slope[knot - 2] + side->slope[knot - 1]) / 2);
    }
  }
  upto_[knot] = upto_[knot - 1];
  if (knot >= 3) upto_[knot].Add(Stretch(knot - 3));
}

void PairCorrelator::PushMarker(std::size_t knot, int a, int b) {
  Push(knot, a_.trial->time_s[static_cast<std::size_t>(a)],
       b_.trial->time_s[static_cast<std::size_t>(b)], static_cast<std::uint16_t>(a),
       static_cast<std::uint16_t>(b));
}

double PairCorrelator::Finish(std::size_t size) {
  const std::size_t end = size + 1;
  Push(end, a_.trial->duration_s, b_.trial->duration_s, kEnd, kEnd);
  for (Side* side : {&a_, &b_}) {
    Limit(*side, end - 1, side->slope[end - 1]);
    side->tangent[end] = side->entering[end];
  }
  Sums sums = upto_[end];
  sums.Add(Stretch(end - 2));
  sums.Add(Stretch(end - 1));
  const double n = points_;
  const double aa = sums.aa - sums.a * sums.a / n;
  const double bb = sums.bb - sums.b * sums.b / n;
  if (!(aa > kConstant * n) || !(bb > kConstant * n)) return 0;
  return std::clamp((sums.ab - sums.a * sums.b / n) / std::sqrt(aa * bb), -1.0, 1.0);
}

PairCorrelator::Sums PairCorrelator::Stretch(std::size_t stretch) {
  if (memory_.empty()) {
    ++computed_;
    return Compute(stretch);
  }
  const Key key{
      static_cast<std::uint64_t>(a_.name[stretch]) << 48 |
          static_cast<std::uint64_t>(b_.name[stretch]) << 32 |
          static_cast<std::uint64_t>(a_.name[stretch + 1]) << 16 |
          static_cast<std::uint64_t>(b_.name[stretch + 1]),
      {a_.tangent[stretch], a_.tangent[stretch + 1], b_.tangent[stretch], b_.tangent[stretch + 1]}};
  std::uint64_t hash = Mix(0, key.knots);
  for (const double tangent : key.tangents) hash = Mix(hash, std::bit_cast<std::uint64_t>(tangent));
  Remembered& place = memory_[hash & (memory_.size() - 1)];
  if (!place.used || !(place.key == key)) {
    place = {key, Compute(stretch), true};
    ++computed_;
  }
  return place.sums;
}

PairCorrelator::Sums PairCorrelator::Compute(std::size_t stretch) {
  const double from = common_s_[stretch];
  const double width = common_s_[stretch + 1] - from;
  const auto first = static_cast<int>(std::ceil(from / step_s_));
  const bool last = stretch + 2 == common_s_.size();
  const int behind = last ? points_ : static_cast<int>(std::ceil(common_s_[stretch + 1] / step_s_));
  const auto warped = [&](const Side& side) {
    const double scale = side.trial->samples_per_s;
    const double y0 = side.own_s[stretch] * scale;
    const double rise = side.own_s[stretch + 1] * scale - y0;
    const double m0 = side.tangent[stretch] * width * scale;
    const double m1 = side.tangent[stretch + 1] * width * scale;
    return WarpedSignal{side.trial->samples.data(),
                        {y0, m0, 3 * rise - 2 * m0 - m1, m0 + m1 - 2 * rise}};
  };
  computed_points_ += std::max(0, behind - first);
  std::array<double, 5> sums = {};
  const GridPart part{first, behind, step_s_ / width, -from / width};
  (HasWideVectors() ? AddPointsWide : AddPoints)(warped(a_), warped(b_), part, sums.data());
  return {sums[0], sums[1], sums[2], sums[3], sums[4]};
}

double PairCorrelator::Correlate(std::span<const int> a_subset, std::span<const int> b_subset) {
  Restart(a_subset.size());
  for (std::size_t m = 0; m < a_subset.size(); ++m) PushMarker(m + 1, a_subset[m], b_subset[m]);
  return Finish(a_subset.size());
}

struct PairCorrelator::Walk {
  const std::vector<int>& a_kept;
  const std::vector<int>& b_kept;
  std::size_t size;
  const Take& take;
  // [follow][after]: subsets of `follow` candidates among `after`.
  std::vector<std::vector<std::size_t>> subsets;
};

void PairCorrelator::Descend(const Walk& walk, std::size_t knot, std::size_t a_from,
                             std::size_t b_from, std::size_t a_rank, std::size_t b_rank) {
  if (knot > walk.size) {
    walk.take(a_rank, b_rank, Finish(walk.size));
    return;
  }
  // So many markers still follow this one; so many subsets begin with the path up to here and it.
  const std::size_t follow = walk.size - knot;
  const std::vector<std::size_t>& subsets = walk.subsets[follow];
  const std::size_t na = walk.a_kept.size();
  const std::size_t nb = walk.b_kept.size();
  std::size_t a_at = a_rank;
  for (std::size_t a = a_from; a + follow < na; ++a) {
    std::size_t b_at = b_rank;
    for (std::size_t b = b_from; b + follow < nb; ++b) {
      PushMarker(knot, walk.a_kept[a], walk.b_kept[b]);
      Descend(walk, knot + 1, a + 1, b + 1, a_at, b_at);
      b_at += subsets[nb - b - 1];
    }
    a_at += subsets[na - a - 1];
  }
}

void PairCorrelator::CorrelateAll(const std::vector<int>& a_kept, const std::vector<int>& b_kept,
                                  std::size_t size, const Take& take) {
  Restart(size);
  Walk walk{a_kept, b_kept, size, take, {}};
  for (std::size_t follow = 0; follow < size; ++follow) {
    walk.subsets.emplace_back();
    for (std::size_t after = 0; after < std::max(a_kept.size(), b_kept.size()); ++after) {
      walk.subsets.back().push_back(static_cast<std::size_t>(Binomial(after, follow)));
    }
  }
  Descend(walk, 1, 0, 0, 0, 0);
}

}  // namespace exemplar::learning
