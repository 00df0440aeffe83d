#include "learning/store_schema.hpp"

#include <array>

namespace exemplar::learning_service {
namespace {

/// Step i brings a file from user_version i to i + 1. Never edited once released: only added to.
constexpr std::array kSchemaSteps = {R"sql(
CREATE TABLE trials (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  skill TEXT NOT NULL,
  source TEXT NOT NULL,
  submitted_ns INTEGER NOT NULL,
  info TEXT NOT NULL,
  file BLOB NOT NULL
) STRICT;
CREATE INDEX trials_by_skill ON trials (skill, number);
CREATE TABLE skills (
  name TEXT PRIMARY KEY,
  current INTEGER NOT NULL,
  last INTEGER NOT NULL
) STRICT;
CREATE TABLE versions (
  skill TEXT NOT NULL REFERENCES skills (name) ON DELETE CASCADE,
  version INTEGER NOT NULL,
  method TEXT NOT NULL,
  target TEXT NOT NULL,
  learned_ns INTEGER NOT NULL,
  options TEXT NOT NULL,
  trial_ids TEXT NOT NULL,
  document BLOB NOT NULL,
  PRIMARY KEY (skill, version)
) STRICT;
)sql",
                                     R"sql(
CREATE TABLE version_numbers (
  skill TEXT PRIMARY KEY,
  last INTEGER NOT NULL
) STRICT;
INSERT INTO version_numbers SELECT name, last FROM skills;
ALTER TABLE skills DROP COLUMN last;
)sql",
                                     R"sql(
CREATE TABLE trial_persons (
  trial_id TEXT PRIMARY KEY,
  person TEXT NOT NULL
) STRICT;
CREATE INDEX trial_persons_by_person ON trial_persons (person);
CREATE TABLE erased_persons (
  salt BLOB NOT NULL,
  hash BLOB NOT NULL,
  erased_ns INTEGER NOT NULL,
  finished INTEGER NOT NULL,
  PRIMARY KEY (salt, hash)
) STRICT;
)sql"};

/// Makes the file ours to SQLite's `file` command and to Open: "Exmp".
constexpr std::int64_t kApplicationId = 0x45786d70;

Result<std::int64_t> ReadPragma(Database& database, const std::string& name) {
  Statement statement = database.Prepare("PRAGMA " + name);
  const Result<bool> row = statement.Step();
  if (!row) return row.error();
  return statement.Integer(0);
}

}  // namespace

Status Migrate(Database& database, const std::string& file) {
  const Result<std::int64_t> application = ReadPragma(database, "application_id");
  if (!application) return application.error();
  const Result<std::int64_t> version = ReadPragma(database, "user_version");
  if (!version) return version.error();
  const auto newest = static_cast<std::int64_t>(kSchemaSteps.size());
  if (*version > newest) {
    return FailedPrecondition(file + " has schema " + std::to_string(*version) +
                                  ", written by a newer program; this one knows up to " +
                                  std::to_string(newest),
                              "data_dir");
  }
  if (*version > 0 && *application != kApplicationId) {
    return FailedPrecondition(file + " is a database of another program", "data_dir");
  }
  if (*version == newest) return {};
  Result<Transaction> transaction = Transaction::Begin(database);
  if (!transaction) return transaction.error();
  for (std::int64_t step = *version; step < newest; ++step) {
    if (Status done = database.Execute(kSchemaSteps[static_cast<std::size_t>(step)]); !done) {
      return done;
    }
  }
  if (Status marked = database.Execute("PRAGMA application_id = " + std::to_string(kApplicationId) +
                                       "; PRAGMA user_version = " + std::to_string(newest));
      !marked) {
    return marked;
  }
  return transaction->Commit();
}

int NewestSchema() { return static_cast<int>(kSchemaSteps.size()); }

std::string DumpJson(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Result<nlohmann::json> ParseJson(const std::string& text) {
  nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded()) return Error{ErrorCode::kDataLoss, "a stored row is damaged"};
  return json;
}

Status PutPerson(Database& database, const std::string& trial, const std::string& person) {
  if (person.empty()) {
    return database.Prepare("DELETE FROM trial_persons WHERE trial_id = ?").Bind(trial).Run();
  }
  return database
      .Prepare(
          "INSERT INTO trial_persons (trial_id, person) VALUES (?1, ?2)"
          " ON CONFLICT (trial_id) DO UPDATE SET person = ?2")
      .Bind(trial)
      .Bind(person)
      .Run();
}

Status PrunePersons(Database& database) {
  return database.Execute(
      "DELETE FROM trial_persons WHERE trial_id NOT IN (SELECT id FROM trials) AND trial_id NOT IN"
      " (SELECT value FROM versions, json_each(versions.trial_ids))");
}

}  // namespace exemplar::learning_service
