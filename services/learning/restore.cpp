// A backup back into the store: parts are gathered in a database beside it, which becomes part of
// the store in one transaction.

#include <algorithm>
#include <set>

#include "exemplar/security/digest.hpp"
#include "learning/compression.hpp"
#include "learning/store.hpp"
#include "learning/store_schema.hpp"

namespace exemplar::learning_service {
namespace {

using Json = nlohmann::json;
using Names = std::set<std::string>;

constexpr const char* kRows = "store.json";

Error Damaged(const std::string& what) {
  return {ErrorCode::kDataLoss, std::string("the backup's ") + kRows + ": " + what};
}

/// The whole of a part.
Result<std::string> ReadPart(api::BackupSource& source, const api::BackupPart& part) {
  constexpr std::uint64_t kLargest = std::uint64_t{1} << 30;
  if (part.bytes > kLargest) {
    return Error{ErrorCode::kResourceExhausted, "part " + part.name + " has " +
                                                    std::to_string(part.bytes) +
                                                    " bytes, more than a stored file can have"};
  }
  std::string bytes;
  for (;;) {
    const Result<std::string> more = source.Read();
    if (!more) return more.error();
    if (more->empty()) return bytes;
    bytes += *more;
  }
}

struct TrialRow {
  std::string id, skill, source, info, person;
  std::int64_t submitted_ns = 0;
};
struct VersionRow {
  std::string skill, method, target, options, trial_ids;
  std::int64_t version = 0;
  std::int64_t learned_ns = 0;
};

/// "store.json" as values.
struct Rows {
  std::vector<TrialRow> trials;
  std::vector<VersionRow> versions;
  std::map<std::string, std::int64_t> current;
  std::map<std::string, std::int64_t> numbers;
  std::map<std::string, std::string> persons;
  std::vector<api::ErasedPerson> erased;
};

Result<Rows> ReadRows(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return Damaged("it is no JSON");
  // nlohmann tells of missing and mistyped members by exceptions.
  try {
    Rows rows;
    rows.persons = json.at("trial_persons").get<std::map<std::string, std::string>>();
    rows.numbers = json.at("version_numbers").get<std::map<std::string, std::int64_t>>();
    for (const Json& row : json.at("trials")) {
      TrialRow trial{.id = row.at("id"),
                     .skill = row.at("skill"),
                     .source = row.at("source"),
                     .info = row.at("info"),
                     .person = {},
                     .submitted_ns = row.at("submitted_ns")};
      const auto person = rows.persons.find(trial.id);
      if (person != rows.persons.end()) trial.person = person->second;
      rows.trials.push_back(std::move(trial));
    }
    for (const Json& row : json.at("skills")) {
      rows.current[row.at("name").get<std::string>()] = row.at("current");
    }
    for (const Json& row : json.at("versions")) {
      rows.versions.push_back({.skill = row.at("skill"),
                               .method = row.at("method"),
                               .target = row.at("target"),
                               .options = row.at("options"),
                               .trial_ids = row.at("trial_ids"),
                               .version = row.at("version"),
                               .learned_ns = row.at("learned_ns")});
    }
    for (const Json& row : json.at("erased_persons")) {
      rows.erased.push_back({.salt = row.at("salt"),
                             .hash = row.at("hash"),
                             .erased = Stamp::FromNanoseconds(row.at("erased_ns"))});
    }
    return rows;
  } catch (const Json::exception& e) {
    return Damaged(e.what());
  }
}

/// Takes out of `rows` what belongs to persons who were erased after it came.
class Sieve {
 public:
  explicit Sieve(std::vector<api::ErasedPerson> erased) : erased_(std::move(erased)) {}

  Result<RestoreOutcome> Apply(Rows& rows) {
    RestoreOutcome outcome;
    TrialNames gone;
    Names stored;
    for (const TrialRow& trial : rows.trials) {
      stored.insert(trial.id);
      if (!IsErased(trial.person, trial.submitted_ns)) continue;
      gone.ids.insert(trial.id);
      gone.sources.insert({trial.skill, trial.source});
      outcome.report.items.push_back({.kind = "trial",
                                      .name = trial.id,
                                      .action = "left out",
                                      .detail = "its person was erased"});
    }
    for (const auto& [id, person] : rows.persons) {
      // A trial that was deleted before the backup, and stands in a version still.
      if (!stored.contains(id) && IsErased(person, 0)) gone.ids.insert(id);
    }
    std::erase_if(rows.trials, [&](const TrialRow& row) { return gone.ids.contains(row.id); });
    std::erase_if(rows.persons, [&](const auto& entry) { return gone.ids.contains(entry.first); });
    std::vector<VersionRow> kept;
    for (VersionRow& version : rows.versions) {
      const Result<StoredVersion> read = ToStored(version);
      if (!read) return read.error();
      if (!Mentions(*read, gone)) {
        kept.push_back(std::move(version));
        continue;
      }
      outcome.report.items.push_back({.kind = "skill version",
                                      .name = version.skill + " " + std::to_string(version.version),
                                      .action = "left out",
                                      .detail = "it was learned from an erased person's trials"});
      if (rows.current[version.skill] == version.version) {
        outcome.relearn.push_back({version.skill, read->options, read->info.trial_ids});
      }
    }
    rows.versions = std::move(kept);
    ChooseCurrent(rows);
    return outcome;
  }

 private:
  static Result<StoredVersion> ToStored(const VersionRow& row) {
    const Json options = Json::parse(row.options, nullptr, false);
    const Json ids = Json::parse(row.trial_ids, nullptr, false);
    if (!options.is_object() || !ids.is_array()) {
      return Damaged("skill " + row.skill + " version " + std::to_string(row.version));
    }
    try {
      StoredVersion version;
      version.skill = row.skill;
      version.options = options.get<std::map<std::string, std::string>>();
      version.info.trial_ids = ids.get<std::vector<std::string>>();
      return version;
    } catch (const Json::exception& e) {
      return Damaged(e.what());
    }
  }

  static void ChooseCurrent(Rows& rows) {
    std::map<std::string, std::int64_t> newest;
    std::map<std::string, std::int64_t> chosen;
    for (const VersionRow& version : rows.versions) {
      newest[version.skill] = std::max(newest[version.skill], version.version);
      if (rows.current[version.skill] == version.version) chosen[version.skill] = version.version;
    }
    for (auto& [skill, version] : newest) {
      const auto was = chosen.find(skill);
      if (was != chosen.end()) version = was->second;
    }
    rows.current = std::move(newest);
  }

  bool IsErased(const std::string& person, std::int64_t since_ns) {
    if (person.empty()) return false;
    return std::any_of(erased_.begin(), erased_.end(), [&](const api::ErasedPerson& erased) {
      return since_ns <= erased.erased.nanoseconds() &&
             hasher_.Hash(erased.salt, person) == erased.hash;
    });
  }

  const std::vector<api::ErasedPerson> erased_;
  security::PersonHasher hasher_;
};

/// The database beside the store; gone with this value.
class Staging {
 public:
  static Result<std::unique_ptr<Staging>> Create(const std::filesystem::path& file) {
    Remove(file);
    Result<std::unique_ptr<Database>> database = Database::Open(file);
    if (!database) return database.error();
    auto staging = std::unique_ptr<Staging>(new Staging(file, *std::move(database)));
    // It is thrown away with whatever breaks off.
    for (const Status& done :
         {staging->database_->Execute("PRAGMA synchronous = OFF"),
          Migrate(*staging->database_, file.string()), staging->database_->Execute("BEGIN")}) {
      if (!done) return done.error();
    }
    return staging;
  }
  ~Staging() {
    database_.reset();
    Remove(file_);
  }
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  Database& database() { return *database_; }
  const std::filesystem::path& file() const { return file_; }

  Status PutRows(const Rows& rows) {
    for (const auto& [skill, current] : rows.current) {
      if (Status done = database_->Prepare("INSERT INTO skills (name, current) VALUES (?, ?)")
                            .Bind(skill)
                            .Bind(current)
                            .Run();
          !done) {
        return done;
      }
    }
    for (const auto& [skill, last] : rows.numbers) {
      if (Status done =
              database_->Prepare("INSERT INTO version_numbers (skill, last) VALUES (?, ?)")
                  .Bind(skill)
                  .Bind(last)
                  .Run();
          !done) {
        return done;
      }
    }
    for (const auto& [trial, person] : rows.persons) {
      if (Status done = PutPerson(*database_, trial, person); !done) return done;
    }
    for (const api::ErasedPerson& erased : rows.erased) {
      if (Status done = database_
                            ->Prepare("INSERT OR REPLACE INTO erased_persons"
                                      " (salt, hash, erased_ns, finished) VALUES (?, ?, ?, 1)")
                            .BindBlob(erased.salt)
                            .BindBlob(erased.hash)
                            .Bind(erased.erased.nanoseconds())
                            .Run();
          !done) {
        return done;
      }
    }
    return {};
  }

  Status PutTrial(const TrialRow& row, std::string_view file) {
    return database_
        ->Prepare(
            "INSERT INTO trials (id, skill, source, submitted_ns, info, file)"
            " VALUES (?, ?, ?, ?, ?, ?)")
        .Bind(row.id)
        .Bind(row.skill)
        .Bind(row.source)
        .Bind(row.submitted_ns)
        .Bind(row.info)
        .BindBlob(file)
        .Run();
  }

  Status PutVersion(const VersionRow& row, std::string_view document) {
    return database_
        ->Prepare(
            "INSERT INTO versions (skill, version, method, target, learned_ns, options,"
            " trial_ids, document) VALUES (?, ?, ?, ?, ?, ?, ?, ?)")
        .Bind(row.skill)
        .Bind(row.version)
        .Bind(row.method)
        .Bind(row.target)
        .Bind(row.learned_ns)
        .Bind(row.options)
        .Bind(row.trial_ids)
        .BindBlob(document)
        .Run();
  }

 private:
  Staging(std::filesystem::path file, std::unique_ptr<Database> database)
      : file_(std::move(file)), database_(std::move(database)) {}

  static void Remove(const std::filesystem::path& file) {
    std::error_code error;
    for (const char* ending : {"", "-wal", "-shm"}) {
      std::filesystem::remove(file.string() + ending, error);
    }
  }

  const std::filesystem::path file_;
  std::unique_ptr<Database> database_;
};

/// The parts behind "store.json", each to its row.
Status PutParts(const Rows& rows, const Names& left_out, api::BackupSource& source,
                Staging& staging) {
  std::map<std::string, const TrialRow*> trials;
  std::map<std::string, const VersionRow*> versions;
  for (const TrialRow& row : rows.trials) trials["trials/" + row.id + ".zst"] = &row;
  for (const VersionRow& row : rows.versions) {
    versions["skills/" + row.skill + "/" + std::to_string(row.version) + ".zst"] = &row;
  }
  std::size_t put = 0;
  for (;;) {
    const Result<std::optional<api::BackupPart>> part = source.NextPart();
    if (!part) return part.error();
    if (!*part) break;
    const std::string& name = (*part)->name;
    const auto trial = trials.find(name);
    const auto version = versions.find(name);
    if (trial == trials.end() && version == versions.end()) {
      if (left_out.contains(name)) continue;
      return Damaged("it does not know the part " + name);
    }
    const Result<std::string> bytes = ReadPart(source, **part);
    if (!bytes) return bytes.error();
    if (const Result<std::string> whole = Decompress(*bytes); !whole) {
      return WithPlace(whole.error(), "part " + name);
    }
    Status stored;
    if (trial != trials.end()) {
      stored = staging.PutTrial(*trial->second, *bytes);
      trials.erase(trial);
    } else {
      stored = staging.PutVersion(*version->second, *bytes);
      versions.erase(version);
    }
    if (!stored) return stored;
    ++put;
  }
  if (put == rows.trials.size() + rows.versions.size()) return {};
  return Damaged("the part " + (trials.empty() ? versions.begin()->first : trials.begin()->first) +
                 " is missing");
}

Names PartsOf(const Rows& rows) {
  Names names;
  for (const TrialRow& row : rows.trials) names.insert("trials/" + row.id + ".zst");
  for (const VersionRow& row : rows.versions) {
    names.insert("skills/" + row.skill + "/" + std::to_string(row.version) + ".zst");
  }
  return names;
}

constexpr const char* kReplace = R"sql(
DELETE FROM versions; DELETE FROM skills; DELETE FROM trials; DELETE FROM trial_persons;
)sql";

/// What is there stays as it is: trials by their id, skills by their name.
constexpr const char* kTakeOver = R"sql(
INSERT OR IGNORE INTO trials (id, skill, source, submitted_ns, info, file)
  SELECT id, skill, source, submitted_ns, info, file FROM incoming.trials ORDER BY number;
INSERT INTO versions SELECT * FROM incoming.versions WHERE skill IN (SELECT name FROM fresh);
INSERT OR IGNORE INTO trial_persons SELECT * FROM incoming.trial_persons;
INSERT INTO version_numbers SELECT skill, last FROM incoming.version_numbers WHERE true
  ON CONFLICT (skill) DO UPDATE SET last = max(last, excluded.last);
INSERT INTO erased_persons SELECT * FROM incoming.erased_persons WHERE true
  ON CONFLICT (salt, hash) DO UPDATE SET erased_ns = max(erased_ns, excluded.erased_ns);
DROP TABLE fresh;
)sql";
constexpr const char* kFresh = R"sql(
CREATE TEMP TABLE fresh AS SELECT name FROM incoming.skills WHERE name NOT IN
  (SELECT name FROM main.skills);
INSERT INTO skills SELECT * FROM incoming.skills WHERE name IN (SELECT name FROM fresh);
)sql";

}  // namespace

Result<RestoreOutcome> Store::Restore(const api::RestoreRequest& request,
                                      api::BackupSource& source) {
  if (request.plan.schema > NewestSchema()) {
    return FailedPrecondition("the backup has schema " + std::to_string(request.plan.schema) +
                                  ", written by a newer program; this one knows up to " +
                                  std::to_string(NewestSchema()),
                              "header.plan.schema");
  }
  const auto check_empty = [&]() -> Status {
    if (request.mode != api::RestoreMode::kEmptyOnly) return {};
    const Result<bool> empty = IsEmpty();
    if (!empty) return empty.error();
    if (*empty) return {};
    return FailedPrecondition(
        "the store holds trials or skills; say whether to merge or to replace them", "header.mode");
  };
  if (const Status may = check_empty(); !may) return may.error();

  const Result<std::optional<api::BackupPart>> first = source.NextPart();
  if (!first) return first.error();
  if (!*first || (*first)->name != kRows) return Damaged("it is not the first part");
  const Result<std::string> text = ReadPart(source, **first);
  if (!text) return text.error();
  Result<Rows> rows = ReadRows(*text);
  if (!rows) return rows.error();
  const Names all = PartsOf(*rows);
  Result<std::vector<api::ErasedPerson>> erased = ErasedPersons();
  if (!erased) return erased.error();
  rows->erased.insert(rows->erased.end(), request.erased.begin(), request.erased.end());
  erased->insert(erased->end(), rows->erased.begin(), rows->erased.end());
  Result<RestoreOutcome> outcome = Sieve(*erased).Apply(*rows);
  if (!outcome) return outcome.error();
  Names left_out = all;
  for (const std::string& name : PartsOf(*rows)) left_out.erase(name);

  const Result<std::unique_ptr<Staging>> staging = Staging::Create(folder_ / "restoring.db");
  if (!staging) return staging.error();
  if (const Status put = (*staging)->PutRows(*rows); !put) return put.error();
  if (const Status put = PutParts(*rows, left_out, source, **staging); !put) return put.error();
  if (const Status kept = (*staging)->database().Execute("COMMIT"); !kept) return kept.error();
  if (const Status may = check_empty(); !may) return may.error();

  const std::lock_guard lock(mutex_);
  if (const Status attached = database_->Prepare("ATTACH DATABASE ? AS incoming")
                                  .Bind((*staging)->file().string())
                                  .Run();
      !attached) {
    return attached.error();
  }
  const auto take_over = [&]() -> Status {
    Result<Transaction> transaction = Transaction::Begin(*database_);
    if (!transaction) return transaction.error();
    if (request.mode == api::RestoreMode::kReplace) {
      if (Status emptied = database_->Execute(kReplace); !emptied) return emptied;
    }
    const auto note = [&](const char* kind, const std::string& name, bool there) {
      outcome->report.items.push_back({.kind = kind,
                                       .name = name,
                                       .action = there ? "kept" : "restored",
                                       .detail = there ? "it was there" : ""});
    };
    for (const TrialRow& row : rows->trials) {
      const Result<bool> there =
          database_->Prepare("SELECT 1 FROM main.trials WHERE id = ?").Bind(row.id).Step();
      if (!there) return there.error();
      note("trial", row.id, *there);
    }
    for (const VersionRow& row : rows->versions) {
      const Result<bool> there =
          database_->Prepare("SELECT 1 FROM main.skills WHERE name = ?").Bind(row.skill).Step();
      if (!there) return there.error();
      note("skill version", row.skill + " " + std::to_string(row.version), *there);
    }
    std::erase_if(outcome->relearn, [&](const Relearning& skill) {
      const Result<bool> there =
          database_->Prepare("SELECT 1 FROM main.skills WHERE name = ?").Bind(skill.skill).Step();
      return there && *there;
    });
    if (Status chosen = database_->Execute(kFresh); !chosen) return chosen;
    if (Status taken = database_->Execute(kTakeOver); !taken) return taken;
    if (Status pruned = PrunePersons(*database_); !pruned) return pruned;
    return transaction->Commit();
  };
  const Status taken = take_over();
  const Status detached = database_->Execute("DETACH DATABASE incoming");
  if (!taken) return taken.error();
  if (!detached) return detached.error();
  return *std::move(outcome);
}

}  // namespace exemplar::learning_service
