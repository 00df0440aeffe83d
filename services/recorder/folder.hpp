#pragma once
#include <filesystem>
#include <string>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"

namespace exemplar::recorder {

/// "20261122T032433.123Z": what a recording is called that was given no name.
std::string NameFromTime(Stamp stamp);

/// Makes the folder where it is absent; fails when it cannot be written.
Status MakeFolder(const std::filesystem::path& folder);

}  // namespace exemplar::recorder
