#pragma once
// From a source's time stamps onto others. Samples are rows, channels are columns.

#include <Eigen/Core>
#include <span>
#include <vector>

namespace exemplar::signal {

/// Where `at` lies within increasing times: between[index] and [index + 1], `part` of the way;
/// held at the ends. Precondition: times not empty and not decreasing.
struct Place {
  std::size_t index = 0;
  double part = 0;  ///< in [0, 1]
};
Place Locate(std::span<const double> times, double at);

/// Linear interpolation, held before the first and after the last sample. Precondition: as many
/// times as rows, at least one.
Eigen::MatrixXd Interpolate(std::span<const double> times_s,
                            const Eigen::Ref<const Eigen::MatrixXd>& values,
                            std::span<const double> at_s);

/// `count` evenly spaced times from `first_s` to `last_s`, both met exactly. Precondition: count >=
/// 2.
std::vector<double> EvenTimes(double first_s, double last_s, int count);

/// The median interval between increasing times; 0 of fewer than two.
double MedianInterval(std::span<const double> times_s);

/// Stretches between neighbouring samples longer than `limit_s`.
struct Gap {
  double begin_s = 0;
  double end_s = 0;
};
std::vector<Gap> FindGaps(std::span<const double> times_s, double limit_s);

/// Which samples of a sample-and-hold stream are news. Where a source is recorded faster than it
/// measures, many samples repeat the one before to the last bit, and the held steps would pass for
/// noise. Kept are the samples that differ from the one before, and both ends of a stillness: a
/// value held for more than four times the usual interval between news, or a quarter of a second.
/// All, when less than a fifth of the samples repeat. Precondition: as many times as rows.
std::vector<std::size_t> FindNews(std::span<const double> times_s,
                                  const Eigen::Ref<const Eigen::MatrixXd>& values);

}  // namespace exemplar::signal
