#pragma once
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::cli {

/// Draws the skill of an exported document (api::SkillApi::ExportJson) into `folder`, which is made
/// where there is none: figure-04.svg to figure-14.svg and index.html. Returns one line a file
/// written, with what stands in the way of a figure behind its name.
Result<std::vector<std::string>> WriteFigures(const std::string& document,
                                              const std::string& folder);

}  // namespace exemplar::cli
