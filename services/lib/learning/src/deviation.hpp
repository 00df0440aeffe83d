#pragma once
#include <span>

#include "exemplar/demonstration/motion.hpp"

namespace exemplar::learning {

/// How far `answer` is from `shown`. Paths of more than `max_points` poses are thinned evenly for
/// the Fréchet distance. Precondition: neither is empty.
demonstration::Deviation Compare(std::span<const geometry::Pose> answer,
                                 std::span<const geometry::Pose> shown, int max_points = 2000);

}  // namespace exemplar::learning
