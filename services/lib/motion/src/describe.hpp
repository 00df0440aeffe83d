#pragma once
#include <string>

#include "exemplar/collision/scene.hpp"

namespace exemplar::motion {

/// "at 2.35 s "forearm" is 12.3 mm deep in "table" at (0.500, 0.100, 0.020)".
std::string DescribeViolation(const collision::Violation& violation, double required_clearance_m);

}  // namespace exemplar::motion
