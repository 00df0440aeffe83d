#include "learning/database.hpp"

#include <sqlite3.h>

namespace exemplar::learning_service {

Statement::Statement(Database& database, sqlite3_stmt* statement, int failure)
    : database_(&database), statement_(statement), failure_(failure) {}

void Statement::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Statement& Statement::Bind(std::string_view text) {
  if (failure_ == SQLITE_OK) {
    failure_ = sqlite3_bind_text64(statement_.get(), ++bound_, text.data(), text.size(),
                                   SQLITE_TRANSIENT, SQLITE_UTF8);
  }
  return *this;
}

Statement& Statement::Bind(std::int64_t number) {
  if (failure_ == SQLITE_OK) failure_ = sqlite3_bind_int64(statement_.get(), ++bound_, number);
  return *this;
}

Statement& Statement::BindBlob(std::string_view bytes) {
  if (failure_ == SQLITE_OK) {
    failure_ = sqlite3_bind_blob64(statement_.get(), ++bound_, bytes.data(), bytes.size(),
                                   SQLITE_TRANSIENT);
  }
  return *this;
}

Result<bool> Statement::Step() {
  if (failure_ != SQLITE_OK) return database_->Failure(failure_);
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return database_->Failure(code);
}

Status Statement::Run() {
  for (;;) {
    const Result<bool> row = Step();
    if (!row) return row.error();
    if (!*row) return {};
  }
}

std::string Statement::Text(int column) const {
  const auto* text = sqlite3_column_text(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return text ? std::string(reinterpret_cast<const char*>(text), size) : std::string();
}

std::string Statement::Blob(int column) const {
  const void* bytes = sqlite3_column_blob(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return bytes ? std::string(static_cast<const char*>(bytes), size) : std::string();
}

std::int64_t Statement::Integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

Database::Database(sqlite3* connection, std::string name)
    : connection_(connection), name_(std::move(name)) {}

void Database::Close::operator()(sqlite3* connection) const { sqlite3_close_v2(connection); }

Result<std::unique_ptr<Database>> Database::Open(const std::filesystem::path& file) {
  sqlite3* connection = nullptr;
  const int code =
      sqlite3_open_v2(file.c_str(), &connection,
                      SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, nullptr);
  // A connection is there even where opening failed: it knows why.
  std::unique_ptr<Database> database(new Database(connection, file.string()));
  if (code != SQLITE_OK) return database->Failure(code);
  sqlite3_extended_result_codes(connection, 1);
  if (const Status set = database->Execute(
          "PRAGMA busy_timeout = 5000; PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL;"
          // What is deleted is overwritten, so that nothing of it stays in the file's free pages.
          "PRAGMA foreign_keys = ON; PRAGMA secure_delete = ON;");
      !set) {
    return set.error();
  }
  return database;
}

Statement Database::Prepare(std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v2(connection_.get(), sql.data(), static_cast<int>(sql.size()),
                                      &statement, nullptr);
  return {*this, statement, code};
}

Status Database::Execute(const std::string& sql) {
  const int code = sqlite3_exec(connection_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) return Failure(code);
  return {};
}

std::int64_t Database::changes() const { return sqlite3_changes64(connection_.get()); }

Status Database::EmptyWal() {
  Statement statement = Prepare("PRAGMA wal_checkpoint(TRUNCATE)");
  const Result<bool> row = statement.Step();
  if (!row) return row.error();
  if (statement.Integer(0) == 0) return {};
  return Unavailable(name_ + ": somebody reads it; its log cannot be emptied yet");
}

Error Database::Failure(int code) const {
  const std::string message = name_ + ": " + sqlite3_errmsg(connection_.get());
  switch (code & 0xff) {
    case SQLITE_FULL:
    case SQLITE_TOOBIG:
    case SQLITE_NOMEM:
      return {ErrorCode::kResourceExhausted, message};
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return {ErrorCode::kDataLoss, message};
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
    case SQLITE_PERM:
      return FailedPrecondition(message, "data_dir");
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return Unavailable(message);
    default:
      return Internal(message);
  }
}

Result<Transaction> Transaction::Begin(Database& database) {
  if (const Status begun = database.Execute("BEGIN IMMEDIATE"); !begun) return begun.error();
  return Transaction(database);
}

Transaction::~Transaction() {
  if (!database_) return;
  // Nothing can be done about a failure here: SQLite rolls back by itself at the next start.
  static_cast<void>(database_->Execute("ROLLBACK"));
}

Status Transaction::Commit() {
  Status committed = database_->Execute("COMMIT");
  if (committed) database_ = nullptr;
  return committed;
}

}  // namespace exemplar::learning_service
