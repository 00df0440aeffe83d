#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/api/data.hpp"

namespace exemplar::recorder {

/// Who was erased, as JSON: what "erased.json" holds in the recorder's folder and in backups.
std::string WriteErased(const std::vector<api::ErasedPerson>& erased);
Result<std::vector<api::ErasedPerson>> ReadErased(std::string_view json);

/// Of a folder; empty where there is none.
Result<std::vector<api::ErasedPerson>> LoadErased(const std::filesystem::path& folder);
/// Durable when it returns, and written whole or not at all. Of one hash the latest time stays.
Status SaveErased(const std::filesystem::path& folder, std::vector<api::ErasedPerson> erased);

/// Names that are gone, or new, are durable when it returns.
Status SyncFolder(const std::filesystem::path& folder);

}  // namespace exemplar::recorder
