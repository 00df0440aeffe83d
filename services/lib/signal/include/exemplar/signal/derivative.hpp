#pragma once
#include <Eigen/Core>

namespace exemplar::signal {

/// Rate of change of evenly spaced samples (rows; channels are columns), second order everywhere:
/// central differences inside, one-sided three-point ones at the ends. Zero of a single sample.
/// Precondition: step_s > 0.
Eigen::MatrixXd Derivative(const Eigen::Ref<const Eigen::MatrixXd>& samples, double step_s);

}  // namespace exemplar::signal
