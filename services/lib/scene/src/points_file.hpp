#pragma once
// Point clouds as text.

#include <Eigen/Core>
#include <filesystem>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::scene {

/// One point a line: x, y, z in metres, by blanks; what follows (a colour) is passed over, as are
/// empty lines and those that begin with #. Errors name file and line.
Result<std::vector<Eigen::Vector3d>> ReadPoints(const std::filesystem::path& file);
Result<std::vector<Eigen::Vector3d>> ParsePoints(std::string_view text, std::string_view source);

}  // namespace exemplar::scene
