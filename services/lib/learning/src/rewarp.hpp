#pragma once
// Finer time alignment than the markers give, for interpolation.

#include <span>
#include <vector>

#include "exemplars.hpp"

namespace exemplar::learning {

/// The trial's streams at `from` (own frames, fractional, increasing, one a frame).
ExemplarTrial Rewarped(const ExemplarTrial& trial, std::span<const double> from);

/// Brings each trial's touches onto the trials' mean touch times, where all have the same number of
/// them, so that contact is at one frame in all. Contacts are left to be found again.
void AlignTouches(Exemplars& exemplars);

/// Brings each trial's own contact windows onto their mean, so that all rest at the object at the
/// same frames. As it was where the contacts come from touch, or there is none.
Exemplars AlignedAtContacts(Exemplars exemplars);

/// Brings the trials to the same part of their way (mostly path length, partly time, between
/// contacts), at the mean time of that part: people who pause at different places are then compared
/// where they are, not when. Contacts keep their frames.
Exemplars AlignedByLength(Exemplars exemplars);

}  // namespace exemplar::learning
