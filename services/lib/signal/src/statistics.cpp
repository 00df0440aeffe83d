#include "exemplar/signal/statistics.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace exemplar::signal {

double Quantile(std::vector<double> values, double p) {
  assert(!values.empty());
  const double place = std::clamp(p, 0.0, 1.0) * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const auto lower = values.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(values.begin(), lower, values.end());
  const double low = *lower;
  if (below + 1 == values.size()) return low;
  const double high = *std::min_element(lower + 1, values.end());
  return low + (place - static_cast<double>(below)) * (high - low);
}

double Quantile(const Eigen::Ref<const Eigen::VectorXd>& values, double p) {
  return Quantile(std::vector<double>(values.begin(), values.end()), p);
}

double Deviation(const Eigen::Ref<const Eigen::VectorXd>& values) {
  if (values.size() < 2) return 0;
  return std::sqrt((values.array() - values.mean()).square().mean());
}

double NoiseDeviation(const Eigen::Ref<const Eigen::VectorXd>& values) {
  const Eigen::Index n = values.size();
  if (n < 2) return 0;
  const Eigen::VectorXd steps = (values.tail(n - 1) - values.head(n - 1)).cwiseAbs();
  // A normal variable's median absolute value is 0.6745 deviations; a difference has sqrt(2) of
  // them.
  return Median(steps) / (0.6744897501960817 * std::sqrt(2.0));
}

double Correlation(const Eigen::Ref<const Eigen::VectorXd>& a,
                   const Eigen::Ref<const Eigen::VectorXd>& b) {
  assert(a.size() == b.size());
  if (a.size() < 2) return 0;
  const Eigen::VectorXd da = a.array() - a.mean();
  const Eigen::VectorXd db = b.array() - b.mean();
  const double scale = std::sqrt(da.squaredNorm() * db.squaredNorm());
  // A constant series leaves rounding errors of its level.
  const auto n = static_cast<double>(a.size());
  const double rounding = 1e-24 * n * n * a.cwiseAbs2().mean() * b.cwiseAbs2().mean();
  if (!(scale * scale > rounding)) return 0;
  return std::clamp(da.dot(db) / scale, -1.0, 1.0);
}

}  // namespace exemplar::signal
