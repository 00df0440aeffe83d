#include "exemplar/learning/marker_choice.hpp"

#include <algorithm>
#include <cmath>

#include "exemplar/learning/hermite.hpp"
#include "exemplar/signal/statistics.hpp"

namespace exemplar::learning {
namespace {

std::vector<double> Knots(const MarkerCandidates& trial, std::span<const int> subset) {
  std::vector<double> knots = {0};
  for (const int m : subset) knots.push_back(trial.time_s[static_cast<std::size_t>(m)]);
  knots.push_back(trial.duration_s);
  return knots;
}

double SignalAt(const MarkerCandidates& trial, double time_s) {
  const auto last = static_cast<double>(trial.signal.size() - 1);
  const double place = std::clamp(time_s / trial.duration_s * last, 0.0, last);
  const Eigen::Index at = std::min(static_cast<Eigen::Index>(place), trial.signal.size() - 2);
  const double part = place - static_cast<double>(at);
  return (1 - part) * trial.signal[at] + part * trial.signal[at + 1];
}

Eigen::VectorXd Warped(const MarkerCandidates& trial, const std::vector<double>& mean,
                       const std::vector<double>& own, int points) {
  const MonotoneHermite own_from_mean(mean, own);
  Eigen::VectorXd values(points);
  for (int p = 0; p < points; ++p) {
    values[p] = SignalAt(trial, own_from_mean(mean.back() * p / (points - 1)));
  }
  return values;
}

}  // namespace

double PairCorrelation(const MarkerCandidates& a, std::span<const int> a_subset,
                       const MarkerCandidates& b, std::span<const int> b_subset, int points) {
  const std::vector<double> a_knots = Knots(a, a_subset);
  const std::vector<double> b_knots = Knots(b, b_subset);
  std::vector<double> mean(a_knots.size());
  for (std::size_t k = 0; k < mean.size(); ++k) mean[k] = (a_knots[k] + b_knots[k]) / 2;
  return signal::Correlation(Warped(a, mean, a_knots, points), Warped(b, mean, b_knots, points));
}

double SumOfCorrelations(std::span<const MarkerCandidates> trials,
                         std::span<const std::vector<int>> chosen, int points) {
  double sum = 0;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    for (std::size_t j = i + 1; j < trials.size(); ++j) {
      sum += PairCorrelation(trials[i], chosen[i], trials[j], chosen[j], points);
    }
  }
  return sum;
}

}  // namespace exemplar::learning
