#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "exemplar/base/result.hpp"

namespace exemplar::recorder {

/// Which structs the IDL files of a folder (and the folders in it) declare, by their names on the
/// network ("module::Struct"), each with the file's text in which every #include "..." of the
/// folder stands as text, once. A file that cannot be read is an error that names it; so are two
/// files that declare one struct differently.
Result<std::map<std::string, std::string>> ReadSchemaFolder(const std::filesystem::path& folder);

}  // namespace exemplar::recorder
