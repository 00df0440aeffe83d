#pragma once
// Poses as words, in commands and status.

#include <map>
#include <string>

#include "exemplar/base/result.hpp"
#include "exemplar/geometry/pose.hpp"

namespace exemplar::simulator {

/// "x,y,z,qx,qy,qz,qw".
std::string PoseText(const geometry::Pose& pose);

/// `pose` with what `arguments` (x, y, z, qx, qy, qz, qw) say of it. Errors name the argument and
/// its value.
Result<geometry::Pose> ReadPose(const std::map<std::string, std::string>& arguments,
                                geometry::Pose pose);

}  // namespace exemplar::simulator
