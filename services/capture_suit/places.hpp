#pragma once
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/geometry/pose.hpp"

namespace exemplar::capture_suit {

/// Reads "x,y;x,y,z;x,y,z,qx,qy,qz,qw;...": poses in the base frame (m); what a place leaves out is
/// `otherwise`'s. Errors name the place and the number.
Result<std::vector<geometry::Pose>> ParsePlaces(std::string_view text,
                                                const geometry::Pose& otherwise);

}  // namespace exemplar::capture_suit
