#pragma once
#include <span>

#include "exemplar/demonstration/motion.hpp"

namespace exemplar::learning {

/// How far `answer` is from `shown`. For the Fréchet distance an answer of fewer samples than
/// `shown` is interpolated to as many (it is a motion, not a set of points), and paths of more than
/// `max_points` are thinned. Precondition: neither is empty.
demonstration::Deviation Compare(std::span<const geometry::Pose> answer,
                                 std::span<const geometry::Pose> shown, int max_points = 2000);

}  // namespace exemplar::learning
