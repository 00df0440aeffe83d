#pragma once
// The semantic description that stands beside a URDF (SRDF), as far as collision needs it: which
// pairs of links are never checked.

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::kinematics {

/// Names of links, the lesser first; sorted, each pair once.
using LinkPairs = std::vector<std::pair<std::string, std::string>>;

/// The pairs of <disable_collisions> and of <disable_default_collisions>, without those of
/// <enable_collisions>. Groups, states, end effectors and joints of the file are passed over.
/// Errors name file, line and element: of links that the model has not, of a robot of another name,
/// of misspelt elements.
Result<LinkPairs> ReadSrdf(const std::filesystem::path& file, const RobotModel& model);
Result<LinkPairs> ParseSrdf(std::string_view text, std::string_view source,
                            const RobotModel& model);

}  // namespace exemplar::kinematics
