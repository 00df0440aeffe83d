// What operators do with the store as a whole: persons, erasure.

#include <algorithm>

#include "exemplar/base/text.hpp"
#include "learning/compression.hpp"
#include "learning/store.hpp"
#include "learning/store_schema.hpp"

namespace exemplar::learning_service {
namespace {

/// Runs `sql` once for each of `values`.
Status RunForEach(Database& database, std::string_view sql,
                  const std::vector<std::string>& values) {
  for (const std::string& value : values) {
    if (Status done = database.Prepare(sql).Bind(value).Run(); !done) return done;
  }
  return {};
}

}  // namespace

bool Mentions(const StoredVersion& version, const TrialNames& trials) {
  const auto is_one = [&](const std::string& id) { return trials.ids.contains(id); };
  if (std::any_of(version.info.trial_ids.begin(), version.info.trial_ids.end(), is_one)) {
    return true;
  }
  const auto left_out = version.options.find("leave_out");
  if (left_out == version.options.end()) return false;
  for (const std::string_view entry : Split(left_out->second, ',')) {
    const std::string name(Trim(entry));
    if (is_one(name) || trials.sources.contains({version.skill, name})) return true;
  }
  return false;
}

Result<bool> Store::SetPerson(const std::string& id, const std::string& person) {
  const std::lock_guard lock(mutex_);
  Statement known = database_->Prepare(
      "SELECT 1 FROM trials WHERE id = ?1 UNION ALL"
      " SELECT 1 FROM versions, json_each(versions.trial_ids) WHERE value = ?1 LIMIT 1");
  const Result<bool> row = known.Bind(id).Step();
  if (!row) return row.error();
  if (!*row) return false;
  if (const Status set = PutPerson(*database_, id, person); !set) return set.error();
  return true;
}

Result<std::vector<api::PersonInfo>> Store::ListPersons() {
  const std::lock_guard lock(mutex_);
  // The second part: whose trials are gone, but stand in a skill version.
  Statement statement = database_->Prepare(
      "SELECT coalesce(person, '') AS who, count(*), sum(length(file)), min(submitted_ns),"
      " max(submitted_ns) FROM trials LEFT JOIN trial_persons ON trial_id = id GROUP BY who"
      " UNION ALL SELECT DISTINCT person, 0, 0, 0, 0 FROM trial_persons WHERE person NOT IN"
      " (SELECT person FROM trial_persons JOIN trials ON trial_id = id) ORDER BY 1");
  std::vector<api::PersonInfo> persons;
  for (;;) {
    const Result<bool> row = statement.Step();
    if (!row) return row.error();
    if (!*row) return persons;
    persons.push_back({.person = statement.Text(0),
                       .items = static_cast<std::uint64_t>(statement.Integer(1)),
                       .bytes = static_cast<std::uint64_t>(statement.Integer(2)),
                       .first = Stamp::FromNanoseconds(statement.Integer(3)),
                       .last = Stamp::FromNanoseconds(statement.Integer(4))});
  }
}

Result<std::vector<std::string>> Store::TrialIdsOf(const std::string& person) {
  const std::lock_guard lock(mutex_);
  Statement statement =
      database_->Prepare("SELECT trial_id FROM trial_persons WHERE person = ? ORDER BY trial_id");
  statement.Bind(person);
  std::vector<std::string> ids;
  for (;;) {
    const Result<bool> row = statement.Step();
    if (!row) return row.error();
    if (!*row) return ids;
    ids.push_back(statement.Text(0));
  }
}

Result<std::map<std::string, std::uint64_t>> Store::TrialBytes() {
  const std::lock_guard lock(mutex_);
  Statement statement = database_->Prepare("SELECT id, length(file) FROM trials");
  std::map<std::string, std::uint64_t> bytes;
  for (;;) {
    const Result<bool> row = statement.Step();
    if (!row) return row.error();
    if (!*row) return bytes;
    bytes[statement.Text(0)] = static_cast<std::uint64_t>(statement.Integer(1));
  }
}

Result<std::vector<StoredVersion>> Store::AllVersions() {
  const std::lock_guard lock(mutex_);
  Statement statement = database_->Prepare(
      "SELECT skill, version, version = current, method, target, learned_ns, options, trial_ids"
      " FROM versions JOIN skills ON skill = name ORDER BY skill, version");
  std::vector<StoredVersion> versions;
  for (;;) {
    const Result<bool> row = statement.Step();
    if (!row) return row.error();
    if (!*row) return versions;
    const std::string place =
        "skill " + statement.Text(0) + " version " + std::to_string(statement.Integer(1));
    const Result<nlohmann::json> options = ParseJson(statement.Text(6));
    if (!options) return WithPlace(options.error(), place);
    const Result<nlohmann::json> ids = ParseJson(statement.Text(7));
    if (!ids) return WithPlace(ids.error(), place);
    versions.push_back({.skill = statement.Text(0),
                        .info = {.version = static_cast<int>(statement.Integer(1)),
                                 .current = statement.Integer(2) != 0,
                                 .method = statement.Text(3),
                                 .trial_ids = ids->get<std::vector<std::string>>(),
                                 .learned = Stamp::FromNanoseconds(statement.Integer(5))},
                        .target = statement.Text(4),
                        .options = options->get<std::map<std::string, std::string>>(),
                        .document = {}});
  }
}

Status Store::ReplaceVersions(const std::string& skill, const std::vector<int>& removed,
                              const std::optional<StoredVersion>& added) {
  const std::string document = added ? Compress(added->document) : std::string();
  const std::lock_guard lock(mutex_);
  Result<Transaction> transaction = Transaction::Begin(*database_);
  if (!transaction) return transaction.error();
  if (added) {
    if (Status inserted = InsertVersion(*added, document); !inserted) return inserted;
  }
  for (const int version : removed) {
    if (Status done = database_->Prepare("DELETE FROM versions WHERE skill = ? AND version = ?")
                          .Bind(skill)
                          .Bind(version)
                          .Run();
        !done) {
      return done;
    }
  }
  for (const char* sql :
       {"UPDATE skills SET current = coalesce((SELECT max(version) FROM versions WHERE skill = ?1),"
        " 0) WHERE name = ?1 AND current NOT IN (SELECT version FROM versions WHERE skill = ?1)",
        "DELETE FROM skills WHERE name = ?1 AND name NOT IN (SELECT skill FROM versions)"}) {
    if (Status done = database_->Prepare(sql).Bind(skill).Run(); !done) return done;
  }
  return transaction->Commit();
}

Status Store::DeleteTrials(const std::vector<std::string>& ids) {
  const std::lock_guard lock(mutex_);
  Result<Transaction> transaction = Transaction::Begin(*database_);
  if (!transaction) return transaction.error();
  if (Status done = RunForEach(*database_, "DELETE FROM trials WHERE id = ?", ids); !done) {
    return done;
  }
  if (Status pruned = PrunePersons(*database_); !pruned) return pruned;
  return transaction->Commit();
}

Status Store::BeginErasure(const std::vector<std::string>& trials,
                           const api::ErasedPerson& person) {
  const std::lock_guard lock(mutex_);
  Result<Transaction> transaction = Transaction::Begin(*database_);
  if (!transaction) return transaction.error();
  if (Status noted = database_
                         ->Prepare("INSERT INTO erased_persons (salt, hash, erased_ns, finished)"
                                   " VALUES (?1, ?2, ?3, ?4) ON CONFLICT (salt, hash)"
                                   " DO UPDATE SET erased_ns = ?3, finished = min(finished, ?4)")
                         .BindBlob(person.salt)
                         .BindBlob(person.hash)
                         .Bind(person.erased.nanoseconds())
                         .Bind(std::int64_t{trials.empty() ? 1 : 0})
                         .Run();
      !noted) {
    return noted;
  }
  if (Status done = RunForEach(*database_, "DELETE FROM trials WHERE id = ?", trials); !done) {
    return done;
  }
  return transaction->Commit();
}

Status Store::FinishErasure(const std::vector<std::string>& trials) {
  const std::lock_guard lock(mutex_);
  {
    Result<Transaction> transaction = Transaction::Begin(*database_);
    if (!transaction) return transaction.error();
    // One that was submitted anew meanwhile is stored, and keeps its person.
    if (Status done = RunForEach(*database_,
                                 "DELETE FROM trial_persons WHERE trial_id = ?1"
                                 " AND trial_id NOT IN (SELECT id FROM trials)",
                                 trials);
        !done) {
      return done;
    }
    if (Status kept = transaction->Commit(); !kept) return kept;
  }
  if (Status rewritten = database_->Execute("VACUUM"); !rewritten) return rewritten;
  if (Status emptied = database_->EmptyWal(); !emptied) return emptied;
  return database_->Execute("UPDATE erased_persons SET finished = 1");
}

Result<bool> Store::HasUnfinishedErasure() {
  const std::lock_guard lock(mutex_);
  Statement statement =
      database_->Prepare("SELECT 1 FROM erased_persons WHERE finished = 0 LIMIT 1");
  return statement.Step();
}

Result<std::vector<api::ErasedPerson>> Store::ErasedPersons() {
  const std::lock_guard lock(mutex_);
  Statement statement =
      database_->Prepare("SELECT salt, hash, erased_ns FROM erased_persons ORDER BY erased_ns");
  std::vector<api::ErasedPerson> persons;
  for (;;) {
    const Result<bool> row = statement.Step();
    if (!row) return row.error();
    if (!*row) return persons;
    persons.push_back({.salt = statement.Blob(0),
                       .hash = statement.Blob(1),
                       .erased = Stamp::FromNanoseconds(statement.Integer(2))});
  }
}

Result<bool> Store::IsEmpty() {
  const std::lock_guard lock(mutex_);
  Statement statement =
      database_->Prepare("SELECT 1 FROM trials UNION ALL SELECT 1 FROM skills LIMIT 1");
  const Result<bool> row = statement.Step();
  if (!row) return row.error();
  return !*row;
}

}  // namespace exemplar::learning_service
