#pragma once
// The access file: who may call what.
//
//   tokens:
//     - name: anna
//       sha256: 9f86…                     # of the token; the token itself is kept nowhere
//       roles: [teach, execute]
//       expires: 2027-01-31T00:00:00Z     # or a date; may be left out
//   certificates:
//     - name: gateway                     # the common name of the caller's TLS certificate
//       sha256: 3b1c…                     # of that certificate; left out: any of its CA
//       roles: [observe]
//       speaks_for_others: true           # may name another caller of this file, and is him then

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/security/role.hpp"

namespace exemplar::security {

/// Somebody known.
struct Caller {
  std::string name;  ///< "anna", or "anna via gateway"
  RoleSet roles;
};

/// What a caller shows.
struct Presented {
  std::string_view token = {};
  std::string_view certificate_name = {};    ///< proven by TLS
  std::string_view certificate_sha256 = {};  ///< of its DER form, hexadecimal
  std::string_view for_whom = {};            ///< whom the caller speaks for; empty: itself
};

/// One line of the file.
struct AccessEntry {
  std::string name;
  std::string sha256 = {};
  RoleSet roles = {};
  std::optional<Stamp> expires = {};
  bool speaks_for_others = false;
};

/// All of the file, as a value.
struct AccessList {
  std::vector<AccessEntry> tokens;
  std::vector<AccessEntry> certificates;
};

/// Errors name the line. `place` is the file's name for them.
Result<AccessList> ParseAccessList(const std::string& yaml, const std::string& place);
std::string ToYaml(const AccessList& list);
/// Writes it whole or not at all, readable by its owner alone.
Status WriteAccessList(const std::filesystem::path& file, const AccessList& list);
Result<AccessList> ReadAccessList(const std::filesystem::path& file);

/// Who shows `who`. Errors (kUnauthenticated; kPermissionDenied for who may not speak for others)
/// say what is missing, and nothing of the file.
Result<Caller> Identify(const AccessList& list, const Presented& who, Stamp now);

/// The file, read again when it changes. What can no longer be read leaves the old entries in
/// force, and is said once. Thread-safe.
class AccessFile {
 public:
  /// The clock and the log outlive it.
  static Result<std::unique_ptr<AccessFile>> Open(std::filesystem::path file, const Clock& clock,
                                                  Log& log);
  Result<Caller> Identify(const Presented& who);

 private:
  /// What tells that a file is another than it was.
  struct Signature {
    std::int64_t changed_ns = 0;
    std::uint64_t inode = 0;
    std::int64_t bytes = 0;
    friend bool operator==(const Signature&, const Signature&) = default;
  };
  static Signature SignatureOf(const std::filesystem::path& file);

  AccessFile(std::filesystem::path file, const Clock& clock, Log& log)
      : file_(std::move(file)), clock_(clock), log_(log) {}

  const std::filesystem::path file_;
  const Clock& clock_;
  Log& log_;
  std::mutex mutex_;
  Signature signature_;
  AccessList list_;
};

/// "2027-01-31" or "2027-01-31T08:00:00Z".
std::optional<Stamp> ParseTime(std::string_view text);

}  // namespace exemplar::security
