#pragma once
// One warp of time for all streams of a trial.

#include <span>
#include <vector>

#include "exemplar/learning/aligned.hpp"

namespace exemplar::learning {

/// The trial on the common time base `common_s`: all its streams, resampled at the own times that a
/// monotone Hermite spline through (common_knots_s, own_knots_s) gives. The spline runs from common
/// to own time, since that is the direction in which series are resampled (a cubic's inverse is
/// none); it bounds the local speed by three times the mean one of a stretch.
/// Precondition: as many knots in both, at least two, both strictly increasing.
UniformTrial WarpTrial(const UniformTrial& trial, std::span<const double> own_knots_s,
                       std::span<const double> common_knots_s, const std::vector<double>& common_s);

}  // namespace exemplar::learning
