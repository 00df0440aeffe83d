#pragma once
// What operators do with the data that a service keeps: whose it is, backup, retention, erasure.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"

namespace exemplar::api {

/// One person's data in one service.
struct PersonInfo {
  std::string person;       ///< pseudonymous id; empty: of nobody knows whom
  std::uint64_t items = 0;  ///< trials or recordings
  std::uint64_t bytes = 0;
  Stamp first;
  Stamp last;
};

/// One thing that was done, or would be.
struct DataItem {
  std::string kind;    ///< "trial", "skill", "skill version", "recording", "database"
  std::string name;    ///< id or file name
  std::string action;  ///< "deleted", "relearned", "kept", "restored", "rewritten"
  std::string detail = {};
  std::uint64_t bytes = 0;
  Stamp at = {};  ///< when it was stored or recorded
};

struct DataReport {
  std::vector<DataItem> items;
  std::vector<std::string> notices;
};

struct EraseRequest {
  std::string person;
  bool dry_run = false;
};

struct RetentionRequest {
  bool dry_run = false;
  std::optional<double> keep_days;  ///< in place of the service's own; 0: never
  std::optional<double> keep_versions_days;
  bool needed_too = false;  ///< trials that a current skill version was learned from, as well
};

/// What a backup holds of one service.
struct BackupPlan {
  std::string service;  ///< "learning" or "recorder"
  int schema = 0;
  std::uint64_t parts = 0;
  std::uint64_t bytes = 0;
  std::map<std::string, std::uint64_t> counts;
  std::vector<std::string> notices;  ///< what was left out, and why
};

struct BackupPart {
  std::string name;  ///< relative path
  std::uint64_t bytes = 0;
};

/// Takes a backup: the plan, then part after part with exactly its bytes. An error ends the backup.
class BackupSink {
 public:
  virtual ~BackupSink() = default;
  virtual Status Begin(const BackupPlan& plan) = 0;
  virtual Status BeginPart(const BackupPart& part) = 0;
  virtual Status Write(std::string_view bytes) = 0;
};

/// Gives a backup back in the same order. The end of the parts says that the backup is whole.
class BackupSource {
 public:
  virtual ~BackupSource() = default;
  /// Passes over what was not read of the part before. nullopt: there is no other.
  virtual Result<std::optional<BackupPart>> NextPart() = 0;
  /// The part's next bytes; empty at its end.
  virtual Result<std::string> Read() = 0;
};

/// Somebody who was erased, without his id.
struct ErasedPerson {
  std::string salt;
  std::string hash;  ///< security::PersonHash(salt, person)
  Stamp erased;
};

enum class RestoreMode {
  kEmptyOnly,  ///< refused where the service holds anything
  kMerge,      ///< adds what is not there; what is there stays
  kReplace,    ///< takes out what is there first
};

struct RestoreRequest {
  BackupPlan plan;
  RestoreMode mode = RestoreMode::kEmptyOnly;
  /// Left out beside those whom the service and the backup know as erased.
  std::vector<ErasedPerson> erased;
};

using DataProgress = std::function<void(double fraction, std::string_view step)>;

/// Implementations are thread-safe. Of Erase, ApplyRetention, Backup and Restore one runs at a
/// time: another is refused with kFailedPrecondition that says what is under way.
class DataApi {
 public:
  virtual ~DataApi() = default;
  virtual Result<std::vector<PersonInfo>> ListPersons() = 0;
  /// A person of whom nothing is kept is no error. What a broken erasure has done stays done; the
  /// next one finishes it.
  virtual Result<DataReport> Erase(const EraseRequest& request, const DataProgress& progress,
                                   std::stop_token stop) = 0;
  virtual Result<DataReport> ApplyRetention(const RetentionRequest& request) = 0;
  /// A consistent copy, while the service goes on.
  virtual Status Backup(BackupSink& sink, std::stop_token stop) = 0;
  /// All or nothing.
  virtual Result<DataReport> Restore(const RestoreRequest& request, BackupSource& source) = 0;
};

/// A person's id: 1 to 100 characters of UTF-8, none of them a control character.
inline Status CheckPerson(std::string_view person, std::string_view field) {
  constexpr std::size_t kLongest = 100;
  bool valid = !person.empty() && person.size() <= kLongest;
  for (const char c : person) valid = valid && static_cast<unsigned char>(c) >= 0x20 && c != 0x7f;
  if (valid) return {};
  return InvalidArgument("a person's id must be 1 to 100 bytes without control characters",
                         std::string(field));
}

}  // namespace exemplar::api
