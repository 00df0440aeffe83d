#pragma once
#include <string>

#include "exemplar/collision/scene.hpp"

namespace exemplar::motion {

/// `at 2.35 s "forearm" and "table" are 12.3 mm inside each other near (0.500, 0.100, 0.008) and
/// (0.500, 0.100, 0.020) m`: the nearest points, or the deepest, of the first and of the second.
std::string DescribeViolation(const collision::Violation& violation, double required_clearance_m);

}  // namespace exemplar::motion
