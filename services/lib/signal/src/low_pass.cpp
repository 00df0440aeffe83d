#include "exemplar/signal/low_pass.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace exemplar::signal {
namespace {

struct Biquad {
  double b0, b1, b2, a1, a2;
};

Biquad Butterworth(double cutoff_part) {
  const double k = std::tan(std::numbers::pi * cutoff_part);
  const double norm = 1 / (1 + std::numbers::sqrt2 * k + k * k);
  const double b0 = k * k * norm;
  return {b0, 2 * b0, b0, 2 * (k * k - 1) * norm, (1 - std::numbers::sqrt2 * k + k * k) * norm};
}

// In place, all channels (one column a sample), starting as if the input had come along the line
// through sample 0 with `slope` a sample for ever: the output follows it by the filter's delay.
void Run(const Biquad& f, const Eigen::VectorXd& slope, Eigen::MatrixXd& x) {
  const double gain = 1 + f.a1 + f.a2;
  const double delay = (f.b1 + 2 * f.b2 - f.a1 - 2 * f.a2) / gain;
  const Eigen::VectorXd first = x.col(0) - delay * slope;
  Eigen::VectorXd z1 = first - f.b0 * x.col(0);
  Eigen::VectorXd z2 = first + slope - f.b0 * (x.col(0) + slope) - f.b1 * x.col(0) + f.a1 * first;
  Eigen::VectorXd y(x.rows());
  for (Eigen::Index k = 0; k < x.cols(); ++k) {
    y = f.b0 * x.col(k) + z1;
    z1 = f.b1 * x.col(k) - f.a1 * y + z2;
    z2 = f.b2 * x.col(k) - f.a2 * y;
    x.col(k) = y;
  }
}

}  // namespace

Eigen::MatrixXd LowPass(const Eigen::Ref<const Eigen::MatrixXd>& samples, double rate_hz,
                        double cutoff_hz) {
  assert(cutoff_hz > 0 && cutoff_hz <= kHighestCutoff * rate_hz * (1 + 1e-9));
  const Eigen::Index n = samples.rows();
  if (n < 3 || samples.cols() == 0) return samples;
  // Two passes take 3 dB at 0.802 of one pass's cut-off. Prewarped, so that the correction is right
  // near the Nyquist frequency too.
  const double two_passes = std::pow(std::numbers::sqrt2 - 1, 0.25);
  const double wanted = std::tan(std::numbers::pi * cutoff_hz / rate_hz);
  const Biquad filter = Butterworth(std::atan(wanted / two_passes) / std::numbers::pi);

  const auto settling = static_cast<Eigen::Index>(std::ceil(2 * rate_hz / cutoff_hz));
  const Eigen::Index pad = std::min(n - 1, settling);
  Eigen::MatrixXd x(samples.cols(), n + 2 * pad);
  x.middleCols(pad, n) = samples.transpose();
  for (Eigen::Index k = 1; k <= pad; ++k) {
    x.col(pad - k) = 2 * samples.row(0) - samples.row(k);
    x.col(pad + n - 1 + k) = 2 * samples.row(n - 1) - samples.row(n - 1 - k);
  }
  const auto mean_slope = [&]() -> Eigen::VectorXd {
    return (x.col(pad) - x.col(0)) / static_cast<double>(pad);
  };
  Run(filter, mean_slope(), x);
  x = x.rowwise().reverse().eval();
  Run(filter, mean_slope(), x);
  return x.rowwise().reverse().middleCols(pad, n).transpose();
}

CutoffChoice ChooseCutoff(const Eigen::Ref<const Eigen::MatrixXd>& samples, double rate_hz) {
  constexpr int kSteps = 24;
  // Below this part of the channels' range, noise is rounding.
  constexpr double kNegligible = 1e-5;
  const Eigen::Index n = samples.rows();
  if (n < 8 || samples.cols() == 0) return {};
  const double range = (samples.colwise().maxCoeff() - samples.colwise().minCoeff()).norm();
  if (range == 0) return {};

  std::array<double, kSteps> cutoff;
  std::array<double, kSteps> residual;  // squared
  const double highest = kHighestCutoff * rate_hz;
  const double lowest = std::min(1.0, highest / 8);
  for (int i = 0; i < kSteps; ++i) {
    const auto at = static_cast<std::size_t>(i);
    cutoff[at] = lowest * std::pow(highest / lowest, i / (kSteps - 1.0));
    residual[at] =
        (LowPass(samples, rate_hz, cutoff[at]) - samples).squaredNorm() / static_cast<double>(n);
  }
  // The line through the upper half of the band.
  double sum = 0, sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0;
  for (std::size_t i = 0; i < kSteps; ++i) {
    if (cutoff[i] < 0.5 * highest) continue;
    sum += 1;
    sum_x += cutoff[i];
    sum_y += residual[i];
    sum_xx += cutoff[i] * cutoff[i];
    sum_xy += cutoff[i] * residual[i];
  }
  const double slope =
      std::min(0.0, (sum * sum_xy - sum_x * sum_y) / (sum * sum_xx - sum_x * sum_x));
  const double noise_squared = (sum_y - slope * sum_x) / sum;
  const double noise = std::sqrt(std::max(0.0, noise_squared));
  if (noise < kNegligible * range) return {0, noise};
  for (std::size_t i = 0; i < kSteps; ++i) {
    if (residual[i] > noise_squared) continue;
    if (i == 0) return {cutoff[0], noise};
    const double part = (residual[i - 1] - noise_squared) / (residual[i - 1] - residual[i]);
    return {cutoff[i - 1] * std::pow(cutoff[i] / cutoff[i - 1], part), noise};
  }
  return {highest, noise};
}

}  // namespace exemplar::signal
