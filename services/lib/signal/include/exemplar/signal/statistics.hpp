#pragma once
#include <Eigen/Core>
#include <vector>

namespace exemplar::signal {

/// The value below which a part `p` in [0, 1] of the values lies, interpolated between order
/// statistics. Precondition: not empty.
double Quantile(std::vector<double> values, double p);
double Quantile(const Eigen::Ref<const Eigen::VectorXd>& values, double p);
inline double Median(const Eigen::Ref<const Eigen::VectorXd>& values) {
  return Quantile(values, 0.5);
}

/// Population deviation: divides by the number of values. 0 of fewer than two.
double Deviation(const Eigen::Ref<const Eigen::VectorXd>& values);

/// Standard deviation of white noise on a slow signal, from the median absolute first difference:
/// steps and trends hardly move it. 0 of fewer than two values.
double NoiseDeviation(const Eigen::Ref<const Eigen::VectorXd>& values);

/// Pearson's correlation; 0 where either series is constant. Precondition: same sizes.
double Correlation(const Eigen::Ref<const Eigen::VectorXd>& a,
                   const Eigen::Ref<const Eigen::VectorXd>& b);

}  // namespace exemplar::signal
