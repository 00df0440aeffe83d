#pragma once
// SQLite behind values and Results.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "exemplar/base/result.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace exemplar::learning_service {

class Database;

/// A prepared statement. Bind in order, then Step through the rows. Thread-compatible.
class Statement {
 public:
  Statement& Bind(std::string_view text);
  Statement& Bind(std::int64_t number);
  Statement& BindBlob(std::string_view bytes);

  /// True: a row is there. False: done.
  Result<bool> Step();
  /// For a statement without rows.
  Status Run();

  /// Columns of the present row, from 0. Copies.
  std::string Text(int column) const;
  std::string Blob(int column) const;
  std::int64_t Integer(int column) const;

 private:
  friend class Database;
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  Statement(Database& database, sqlite3_stmt* statement, int failure);

  Database* database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  int bound_ = 0;
  int failure_;  ///< of preparing or binding: Step reports it
};

/// One connection. What a committed transaction wrote survives a crash (WAL, synchronous=FULL).
/// Thread-compatible.
class Database {
 public:
  /// Made if it is not there. Errors name the file.
  static Result<std::unique_ptr<Database>> Open(const std::filesystem::path& file);

  Statement Prepare(std::string_view sql);
  /// One or more statements without values.
  Status Execute(const std::string& sql);
  /// Rows that the last statement changed.
  std::int64_t changes() const;
  /// Everything is in the main file, and the WAL is empty. kUnavailable while another connection
  /// reads from it.
  Status EmptyWal();
  Error Failure(int code) const;

 private:
  friend class Transaction;
  struct Close {
    void operator()(sqlite3* connection) const;
  };
  Database(sqlite3* connection, std::string name);

  std::unique_ptr<sqlite3, Close> connection_;
  std::string name_;
};

/// All or nothing: rolls back unless committed.
class Transaction {
 public:
  static Result<Transaction> Begin(Database& database);
  Transaction(Transaction&& other) noexcept : database_(std::exchange(other.database_, nullptr)) {}
  Transaction& operator=(Transaction&&) = delete;
  ~Transaction();
  Status Commit();

 private:
  explicit Transaction(Database& database) : database_(&database) {}
  Database* database_;
};

}  // namespace exemplar::learning_service
