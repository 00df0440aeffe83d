#pragma once
// STL files, binary and text, as far as collision needs them: their vertices.

#include <Eigen/Core>
#include <filesystem>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::collision {

/// The corners of all triangles, three a triangle, in the file's own units. Errors name the file
/// and, in text, the line.
Result<std::vector<Eigen::Vector3d>> ReadStl(const std::filesystem::path& file);
Result<std::vector<Eigen::Vector3d>> ParseStl(std::string_view bytes, std::string_view source);

}  // namespace exemplar::collision
