// A backup of the store: "store.json" with every row, then the trials' files and the versions'
// documents as they are stored, each a Zstandard frame. docs/operators_data.md describes the parts.

#include "learning/store.hpp"
#include "learning/store_schema.hpp"

namespace exemplar::learning_service {
namespace {

using Json = nlohmann::json;

Error Cancelled() { return {ErrorCode::kCancelled, "the backup was cancelled"}; }

/// Calls `visit` with each row of `sql`.
template <class Visit>
Status ForEachRow(Database& database, std::string_view sql, const Visit& visit) {
  Statement statement = database.Prepare(sql);
  for (;;) {
    const Result<bool> row = statement.Step();
    if (!row) return row.error();
    if (!*row) return {};
    if (Status visited = visit(statement); !visited) return visited;
  }
}

/// All rows but the large ones' bytes, and what the backup will hold.
struct Description {
  std::string rows;  ///< "store.json"
  api::BackupPlan plan;
};

Result<Description> Describe(Database& database) {
  Description all;
  all.plan.service = "learning";
  all.plan.schema = NewestSchema();
  Json store = {{"schema", NewestSchema()},          {"trials", Json::array()},
                {"skills", Json::array()},           {"versions", Json::array()},
                {"version_numbers", Json::object()}, {"trial_persons", Json::object()},
                {"erased_persons", Json::array()}};
  const auto add_part = [&](std::int64_t bytes) {
    ++all.plan.parts;
    all.plan.bytes += static_cast<std::uint64_t>(bytes);
  };
  struct Table {
    std::string_view sql;
    std::function<void(const Statement&)> take;
  };
  for (const Table& table :
       {Table{"SELECT id, skill, source, submitted_ns, info, length(file) FROM trials"
              " ORDER BY number",
              [&](const Statement& row) {
                store["trials"].push_back({{"id", row.Text(0)},
                                           {"skill", row.Text(1)},
                                           {"source", row.Text(2)},
                                           {"submitted_ns", row.Integer(3)},
                                           {"info", row.Text(4)}});
                add_part(row.Integer(5));
              }},
        Table{"SELECT name, current FROM skills ORDER BY name",
              [&](const Statement& row) {
                store["skills"].push_back({{"name", row.Text(0)}, {"current", row.Integer(1)}});
              }},
        Table{"SELECT skill, version, method, target, learned_ns, options, trial_ids,"
              " length(document) FROM versions ORDER BY skill, version",
              [&](const Statement& row) {
                store["versions"].push_back({{"skill", row.Text(0)},
                                             {"version", row.Integer(1)},
                                             {"method", row.Text(2)},
                                             {"target", row.Text(3)},
                                             {"learned_ns", row.Integer(4)},
                                             {"options", row.Text(5)},
                                             {"trial_ids", row.Text(6)}});
                add_part(row.Integer(7));
              }},
        Table{
            "SELECT skill, last FROM version_numbers",
            [&](const Statement& row) { store["version_numbers"][row.Text(0)] = row.Integer(1); }},
        Table{"SELECT trial_id, person FROM trial_persons",
              [&](const Statement& row) { store["trial_persons"][row.Text(0)] = row.Text(1); }},
        Table{"SELECT salt, hash, erased_ns FROM erased_persons ORDER BY erased_ns",
              [&](const Statement& row) {
                store["erased_persons"].push_back(
                    {{"salt", row.Blob(0)}, {"hash", row.Blob(1)}, {"erased_ns", row.Integer(2)}});
              }}}) {
    const Status read = ForEachRow(database, table.sql, [&](const Statement& row) -> Status {
      table.take(row);
      return {};
    });
    if (!read) return read.error();
  }
  for (const char* name : {"trials", "skills", "versions"}) {
    all.plan.counts[name] = store[name].size();
  }
  all.rows = DumpJson(store);
  ++all.plan.parts;
  all.plan.bytes += all.rows.size();
  return all;
}

/// The rows' bytes, a part each.
Status SendParts(Database& database, std::string_view sql, api::BackupSink& sink,
                 const std::stop_token& stop) {
  return ForEachRow(database, sql, [&](const Statement& row) -> Status {
    if (stop.stop_requested()) return Cancelled();
    const std::string bytes = row.Blob(1);
    if (Status begun = sink.BeginPart({row.Text(0), bytes.size()}); !begun) return begun;
    return sink.Write(bytes);
  });
}

}  // namespace

Status Store::BackUp(api::BackupSink& sink, const std::stop_token& stop) {
  const Result<std::unique_ptr<Database>> database = Database::Open(folder_ / "learning.db");
  if (!database) return database.error();
  // From its first reading on, this transaction sees the database as it is then.
  if (Status begun = (*database)->Execute("BEGIN"); !begun) return begun;
  const Result<Description> all = Describe(**database);
  if (!all) return all.error();
  if (Status begun = sink.Begin(all->plan); !begun) return begun;
  if (Status begun = sink.BeginPart({"store.json", all->rows.size()}); !begun) return begun;
  if (Status sent = sink.Write(all->rows); !sent) return sent;
  for (const char* sql :
       {"SELECT 'trials/' || id || '.zst', file FROM trials ORDER BY number",
        "SELECT 'skills/' || skill || '/' || version || '.zst', document FROM versions"
        " ORDER BY skill, version"}) {
    if (Status sent = SendParts(**database, sql, sink, stop); !sent) return sent;
  }
  return (*database)->Execute("COMMIT");
}

}  // namespace exemplar::learning_service
