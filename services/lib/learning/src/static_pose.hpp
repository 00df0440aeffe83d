#pragma once
#include <optional>

#include "exemplar/demonstration/trial.hpp"

namespace exemplar::learning {

/// The one pose of a thing that stands still: the median of its samples, when it moves no farther
/// than its noise explains, or than a small part of `extent_m`, the way of the motion around it.
/// nullopt when it moves. Precondition: the series is not empty.
std::optional<geometry::Pose> StaticPose(const demonstration::PoseSeries& series, double extent_m);

/// Where a thing stood that a hand takes away: it stands still at first, for half a second at
/// least, and still again at the end. nullopt otherwise. Precondition: the series is not empty.
std::optional<geometry::Pose> TakenFrom(const demonstration::PoseSeries& series, double extent_m);

}  // namespace exemplar::learning
