#include "learning/store.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>

#include "learning/compression.hpp"
#include "learning/store_schema.hpp"

namespace exemplar::learning_service {
namespace {

using Json = nlohmann::json;

constexpr std::string_view kTrialColumns =
    "id, skill, source, submitted_ns, info, coalesce(person, '')";
constexpr std::string_view kTrialTables = " FROM trials LEFT JOIN trial_persons ON trial_id = id";

Result<api::TrialInfo> ReadTrialRow(const Statement& row) {
  api::TrialInfo info;
  info.id = row.Text(0);
  info.skill = row.Text(1);
  info.source = row.Text(2);
  info.submitted = Stamp::FromNanoseconds(row.Integer(3));
  info.person = row.Text(5);
  const Result<Json> json = ParseJson(row.Text(4));
  if (!json) return WithPlace(json.error(), "trial " + info.id);
  info.duration_s = json->value("duration_s", 0.0);
  info.samples = json->value("samples", std::uint64_t{0});
  info.streams = json->value("streams", std::vector<std::string>());
  info.notices = json->value("notices", std::vector<std::string>());
  return info;
}

}  // namespace

/// Held for as long as the store is open; the kernel lets go of it when the process dies.
struct Store::LockFile {
  explicit LockFile(int file) : descriptor(file) {}
  LockFile(const LockFile&) = delete;
  LockFile& operator=(const LockFile&) = delete;
  ~LockFile() { close(descriptor); }

  static Result<std::unique_ptr<LockFile>> Take(const std::filesystem::path& path) {
    const int descriptor = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (descriptor < 0) {
      return FailedPrecondition(path.string() + ": " + std::strerror(errno), "data_dir");
    }
    auto lock = std::make_unique<LockFile>(descriptor);
    if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
      return FailedPrecondition(
          path.parent_path().string() + " is in use by another learning service", "data_dir");
    }
    return lock;
  }

  int descriptor;
};

Store::Store(std::filesystem::path folder, std::unique_ptr<LockFile> lock,
             std::unique_ptr<Database> database)
    : folder_(std::move(folder)), lock_(std::move(lock)), database_(std::move(database)) {}

Store::~Store() = default;

Result<std::unique_ptr<Store>> Store::Open(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return FailedPrecondition(folder.string() + ": " + error.message(), "data_dir");
  Result<std::unique_ptr<LockFile>> lock = LockFile::Take(folder / "learning.lock");
  if (!lock) return lock.error();
  // What a restoring that broke off has left.
  for (const char* left : {"restoring.db", "restoring.db-wal", "restoring.db-shm"}) {
    std::filesystem::remove(folder / left, error);
  }
  // SQLite rewrites the database by way of a file of the same size: where there is room for it.
  static_cast<void>(setenv("SQLITE_TMPDIR", folder.c_str(), 0));
  const std::filesystem::path file = folder / "learning.db";
  Result<std::unique_ptr<Database>> database = Database::Open(file);
  if (!database) return database.error();
  if (const Status migrated = Migrate(**database, file.string()); !migrated) {
    return migrated.error();
  }
  // A process that was killed leaves a log in which what was erased since may still stand.
  if (const Status emptied = (*database)->EmptyWal(); !emptied) return emptied.error();
  return std::unique_ptr<Store>(new Store(folder, *std::move(lock), *std::move(database)));
}

Status Store::AddTrial(const api::TrialInfo& info, std::string_view file) {
  const std::string compressed = Compress(file);
  const Json json = {{"duration_s", info.duration_s},
                     {"samples", info.samples},
                     {"streams", info.streams},
                     {"notices", info.notices}};
  const std::lock_guard lock(mutex_);
  Result<Transaction> transaction = Transaction::Begin(*database_);
  if (!transaction) return transaction.error();
  if (Status added =
          database_
              ->Prepare("INSERT INTO trials (id, skill, source, submitted_ns, info, file)"
                        " VALUES (?, ?, ?, ?, ?, ?)")
              .Bind(info.id)
              .Bind(info.skill)
              .Bind(info.source)
              .Bind(info.submitted.nanoseconds())
              .Bind(DumpJson(json))
              .BindBlob(compressed)
              .Run();
      !added) {
    return added;
  }
  if (!info.person.empty()) {
    if (Status set = PutPerson(*database_, info.id, info.person); !set) return set;
  }
  return transaction->Commit();
}

Result<std::optional<api::TrialInfo>> Store::FindTrial(const std::string& id) {
  const std::lock_guard lock(mutex_);
  Statement statement = database_->Prepare("SELECT " + std::string(kTrialColumns) +
                                           std::string(kTrialTables) + " WHERE id = ?");
  const Result<bool> row = statement.Bind(id).Step();
  if (!row) return row.error();
  if (!*row) return std::optional<api::TrialInfo>();
  Result<api::TrialInfo> info = ReadTrialRow(statement);
  if (!info) return info.error();
  return std::optional(*std::move(info));
}

Result<std::vector<api::TrialInfo>> Store::ListTrials(const std::string& skill,
                                                      const std::string& person) {
  const std::lock_guard lock(mutex_);
  Statement statement =
      database_->Prepare("SELECT " + std::string(kTrialColumns) + std::string(kTrialTables) +
                         " WHERE (?1 = '' OR skill = ?1) AND (?2 = '' OR person = ?2)"
                         " ORDER BY number");
  statement.Bind(skill).Bind(person);
  std::vector<api::TrialInfo> trials;
  for (;;) {
    const Result<bool> row = statement.Step();
    if (!row) return row.error();
    if (!*row) return trials;
    Result<api::TrialInfo> info = ReadTrialRow(statement);
    if (!info) return info.error();
    trials.push_back(*std::move(info));
  }
}

Result<std::string> Store::TrialFile(const std::string& id) {
  std::string compressed;
  {
    const std::lock_guard lock(mutex_);
    Statement statement = database_->Prepare("SELECT file FROM trials WHERE id = ?");
    const Result<bool> row = statement.Bind(id).Step();
    if (!row) return row.error();
    if (!*row) return NotFound("there is no trial \"" + id + "\"", "id");
    compressed = statement.Blob(0);
  }
  Result<std::string> file = Decompress(compressed);
  if (!file) return WithPlace(file.error(), "trial " + id);
  return file;
}

Result<bool> Store::DeleteTrial(const std::string& id) {
  const std::lock_guard lock(mutex_);
  Result<Transaction> transaction = Transaction::Begin(*database_);
  if (!transaction) return transaction.error();
  if (const Status done = database_->Prepare("DELETE FROM trials WHERE id = ?").Bind(id).Run();
      !done) {
    return done.error();
  }
  const bool was_there = database_->changes() > 0;
  if (const Status pruned = PrunePersons(*database_); !pruned) return pruned.error();
  if (const Status kept = transaction->Commit(); !kept) return kept.error();
  return was_there;
}

Result<int> Store::NextVersion(const std::string& skill) {
  const std::lock_guard lock(mutex_);
  Statement statement = database_->Prepare("SELECT last FROM version_numbers WHERE skill = ?");
  const Result<bool> row = statement.Bind(skill).Step();
  if (!row) return row.error();
  return *row ? static_cast<int>(statement.Integer(0)) + 1 : 1;
}

Status Store::AddVersion(const StoredVersion& version) {
  const std::string document = Compress(version.document);
  const std::lock_guard lock(mutex_);
  Result<Transaction> transaction = Transaction::Begin(*database_);
  if (!transaction) return transaction.error();
  if (Status added = InsertVersion(version, document); !added) return added;
  return transaction->Commit();
}

Status Store::InsertVersion(const StoredVersion& version, const std::string& document) {
  for (const char* sql : {"INSERT INTO skills (name, current) VALUES (?1, ?2)"
                          " ON CONFLICT (name) DO UPDATE SET current = ?2",
                          "INSERT INTO version_numbers (skill, last) VALUES (?1, ?2)"
                          " ON CONFLICT (skill) DO UPDATE SET last = ?2"}) {
    Status numbered = database_->Prepare(sql).Bind(version.skill).Bind(version.info.version).Run();
    if (!numbered) return numbered;
  }
  return database_
      ->Prepare(
          "INSERT INTO versions (skill, version, method, target, learned_ns,"
          " options, trial_ids, document) VALUES (?, ?, ?, ?, ?, ?, ?, ?)")
      .Bind(version.skill)
      .Bind(version.info.version)
      .Bind(version.info.method)
      .Bind(version.target)
      .Bind(version.info.learned.nanoseconds())
      .Bind(DumpJson(version.options))
      .Bind(DumpJson(version.info.trial_ids))
      .BindBlob(document)
      .Run();
}

Result<std::vector<api::SkillInfo>> Store::ListSkills() {
  const std::lock_guard lock(mutex_);
  Statement statement = database_->Prepare(
      "SELECT name, current, (SELECT count(*) FROM versions WHERE skill = name), method, target,"
      " json_array_length(trial_ids), learned_ns"
      " FROM skills JOIN versions ON skill = name AND version = current ORDER BY name");
  std::vector<api::SkillInfo> skills;
  for (;;) {
    const Result<bool> row = statement.Step();
    if (!row) return row.error();
    if (!*row) return skills;
    skills.push_back({.name = statement.Text(0),
                      .version = static_cast<int>(statement.Integer(1)),
                      .versions = static_cast<int>(statement.Integer(2)),
                      .method = statement.Text(3),
                      .target = statement.Text(4),
                      .trials = static_cast<int>(statement.Integer(5)),
                      .learned = Stamp::FromNanoseconds(statement.Integer(6))});
  }
}

Result<std::vector<api::VersionInfo>> Store::ListVersions(const std::string& skill) {
  const std::lock_guard lock(mutex_);
  Statement statement = database_->Prepare(
      "SELECT version, version = current, method, trial_ids, learned_ns"
      " FROM versions JOIN skills ON skill = name WHERE skill = ? ORDER BY version");
  statement.Bind(skill);
  std::vector<api::VersionInfo> versions;
  for (;;) {
    const Result<bool> row = statement.Step();
    if (!row) return row.error();
    if (!*row) return versions;
    const Result<Json> ids = ParseJson(statement.Text(3));
    if (!ids) return WithPlace(ids.error(), "skill " + skill);
    versions.push_back({.version = static_cast<int>(statement.Integer(0)),
                        .current = statement.Integer(1) != 0,
                        .method = statement.Text(2),
                        .trial_ids = ids->get<std::vector<std::string>>(),
                        .learned = Stamp::FromNanoseconds(statement.Integer(4))});
  }
}

Result<std::optional<std::string>> Store::Document(const std::string& skill, int version) {
  std::string compressed;
  {
    const std::lock_guard lock(mutex_);
    Statement statement =
        database_->Prepare("SELECT document FROM versions WHERE skill = ? AND version = ?");
    const Result<bool> row = statement.Bind(skill).Bind(version).Step();
    if (!row) return row.error();
    if (!*row) return std::optional<std::string>();
    compressed = statement.Blob(0);
  }
  Result<std::string> document = Decompress(compressed);
  if (!document) {
    return WithPlace(document.error(), "skill " + skill + " version " + std::to_string(version));
  }
  return std::optional(*std::move(document));
}

Status Store::SetCurrent(const std::string& skill, int version) {
  const std::lock_guard lock(mutex_);
  return database_->Prepare("UPDATE skills SET current = ? WHERE name = ?")
      .Bind(version)
      .Bind(skill)
      .Run();
}

Result<bool> Store::DeleteSkill(const std::string& skill) {
  const std::lock_guard lock(mutex_);
  Result<Transaction> transaction = Transaction::Begin(*database_);
  if (!transaction) return transaction.error();
  if (const Status done = database_->Prepare("DELETE FROM skills WHERE name = ?").Bind(skill).Run();
      !done) {
    return done.error();
  }
  const bool was_there = database_->changes() > 0;
  if (const Status pruned = PrunePersons(*database_); !pruned) return pruned.error();
  if (const Status kept = transaction->Commit(); !kept) return kept.error();
  return was_there;
}

}  // namespace exemplar::learning_service
