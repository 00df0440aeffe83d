#pragma once
// Smoothing without delay, and how much of it the data ask for. Samples are rows, evenly spaced;
// channels are columns.

#include <Eigen/Core>

namespace exemplar::signal {

/// The highest cut-off that LowPass takes, as a part of the sample rate.
inline constexpr double kHighestCutoff = 0.4;

/// Zero-phase low-pass: a second-order Butterworth filter run forwards and backwards, its cut-off
/// corrected for the two passes so that the whole is down by 3 dB at `cutoff_hz` (Winter 2009). The
/// ends are continued by point reflection, so a constant and a slope pass unchanged.
/// Precondition: 0 < cutoff_hz <= kHighestCutoff * rate_hz.
Eigen::MatrixXd LowPass(const Eigen::Ref<const Eigen::MatrixXd>& samples, double rate_hz,
                        double cutoff_hz);

/// What residual analysis found.
struct CutoffChoice {
  double cutoff_hz = 0;  ///< 0: no filter is needed, the data hold no noise to speak of
  double noise = 0;      ///< estimated deviation of the noise, all channels together
};

/// Residual analysis (Winter 2009, section 3.4): above the band of the signal, the squared residual
/// of the filter falls in a straight line with the cut-off, as white noise's does; that line at
/// cut-off zero is the noise. The cut-off at which the residual equals it distorts the signal as
/// much as it lets noise through. Channels share a unit and count together.
CutoffChoice ChooseCutoff(const Eigen::Ref<const Eigen::MatrixXd>& samples, double rate_hz);

}  // namespace exemplar::signal
