#pragma once
// Correlations of all pairs of subsets of two trials, with the work shared that pairs have in
// common.

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "exemplar/learning/marker_choice.hpp"

namespace exemplar::learning {

/// A trial's markers and signal, made ready once for all of its pairs.
struct CorrelatedTrial {
  struct Sample {
    double value = 0;
    double slope = 0;  ///< to the next
  };
  explicit CorrelatedTrial(const MarkerCandidates& trial);

  std::vector<double> time_s;  ///< of the candidates
  double duration_s = 0;
  double samples_per_s = 0;
  std::vector<Sample> samples;  ///< of zero mean and unit variance; all zero of a constant signal
};

/// Pearson's r needs five sums over the grid, and each stretch between two knots adds its part of
/// them. A stretch is fixed by its end knots and the four tangents there; a tangent is fixed by a
/// few neighbouring knots. So subsets are walked as a tree in which a stretch is added as soon as
/// its tangents are final, and stretches are remembered by exactly what they depend on: results are
/// those of PairCorrelation to rounding. Thread-compatible.
class PairCorrelator {
 public:
  /// `pairs`: about how many correlations will be asked for; bounds what is remembered. The trials
  /// must outlive this.
  PairCorrelator(const CorrelatedTrial& a, const CorrelatedTrial& b, int points, double pairs);

  /// As PairCorrelation.
  double Correlate(std::span<const int> a_subset, std::span<const int> b_subset);

  /// Calls `take(rank_a, rank_b, r)` once for each pair of subsets of `size` of the kept
  /// candidates; ranks count in the order of AllSubsets.
  using Take = std::function<void(std::size_t rank_a, std::size_t rank_b, double r)>;
  void CorrelateAll(const std::vector<int>& a_kept, const std::vector<int>& b_kept,
                    std::size_t size, const Take& take);

  /// Stretches that were computed, rather than remembered.
  long long computed_stretches() const { return computed_; }
  /// Points of the grid at which both signals were taken. Each costs 16 multiply-adds: one for its
  /// part of the stretch, and for either signal three for the cubic and two for the value, then
  /// five for the sums.
  long long computed_points() const { return computed_points_; }

 private:
  struct Side {
    const CorrelatedTrial* trial = nullptr;
    // By knot of the present path; knot 0 is the start.
    std::vector<double> own_s;
    std::vector<double> slope;     // of the stretch after the knot
    std::vector<double> entering;  // tangent limited by the stretch before the knot
    std::vector<double> tangent;   // limited by the stretch after it too: final
    std::vector<std::uint16_t> name;
  };
  struct Sums {
    double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    void Add(const Sums& other);
  };
  struct Key {
    std::uint64_t knots = 0;
    std::array<double, 4> tangents = {};
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct Remembered {
    Key key;
    Sums sums;
    bool used = false;
  };
  struct Walk;

  void Restart(std::size_t size);
  void Push(std::size_t knot, double a_s, double b_s, std::uint16_t a_name, std::uint16_t b_name);
  void PushMarker(std::size_t knot, int a, int b);
  /// Correlation of the path whose last marker is knot `size`.
  double Finish(std::size_t size);
  /// Fritsch & Carlson's limit on a stretch, from the tangent that enters and the unlimited next.
  static void Limit(Side& side, std::size_t stretch, double next_tangent);
  Sums Stretch(std::size_t stretch);
  Sums Compute(std::size_t stretch);
  void Descend(const Walk& walk, std::size_t knot, std::size_t a_from, std::size_t b_from,
               std::size_t a_rank, std::size_t b_rank);

  Side a_, b_;
  int points_;
  double step_s_;
  std::vector<double> common_s_;  // by knot
  std::vector<Sums> upto_;        // by knot: stretches added when the path got there
  std::size_t most_remembered_ = 0;
  std::vector<Remembered> memory_;
  long long computed_ = 0;
  long long computed_points_ = 0;
};

}  // namespace exemplar::learning
