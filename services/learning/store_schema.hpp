#pragma once
// What the learning service's database looks like, and what several parts of the store do with it.

#include <nlohmann/json.hpp>
#include <string>

#include "exemplar/base/result.hpp"
#include "learning/database.hpp"

namespace exemplar::learning_service {

/// The schema that this program writes.
int NewestSchema();
/// Brings a file of any earlier schema, or an empty one, up to the newest; `file` names it.
Status Migrate(Database& database, const std::string& file);

std::string DumpJson(const nlohmann::json& json);
Result<nlohmann::json> ParseJson(const std::string& text);

/// Empty: unknown.
Status PutPerson(Database& database, const std::string& trial, const std::string& person);
/// Forgets whose trials were that are neither stored nor part of a skill version.
Status PrunePersons(Database& database);

}  // namespace exemplar::learning_service
