#include "exemplar/security/access.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <fstream>
#include <set>
#include <sstream>

#include "exemplar/base/text.hpp"
#include "exemplar/security/digest.hpp"

namespace exemplar::security {
namespace {

std::string At(const std::string& place, const YAML::Node& node) {
  return place + ":" + std::to_string(node.Mark().line + 1) + ": ";
}

bool IsDigest(const std::string& text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

/// Names go into logs and metadata: letters, digits and . _ - @ only.
bool IsName(const std::string& name) {
  return !name.empty() && name.size() <= 64 &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-' || c == '@';
         });
}

Result<RoleSet> ParseRoles(const YAML::Node& node, const std::string& place) {
  if (!node.IsSequence()) {
    return InvalidArgument(At(place, node) + "roles must be a list, like [observe]", "roles");
  }
  RoleSet roles;
  for (const YAML::Node& each : node) {
    const std::string name = each.IsScalar() ? each.Scalar() : std::string();
    const std::optional<Role> role = ParseRole(name);
    if (!role) {
      return InvalidArgument(At(place, each) + '"' + name +
                                 "\" is no role; there are observe, record, teach, execute, "
                                 "administer",
                             "roles");
    }
    roles.Add(*role);
  }
  return roles;
}

Result<AccessEntry> ParseEntry(const YAML::Node& node, const std::string& place) {
  if (!node.IsMap()) return InvalidArgument(At(place, node) + "an entry must be a map");
  AccessEntry entry;
  for (const auto& pair : node) {
    const std::string key = pair.first.Scalar();
    const YAML::Node& value = pair.second;
    const std::string text = value.IsScalar() ? value.Scalar() : std::string();
    if (key == "roles") {
      const Result<RoleSet> roles = ParseRoles(value, place);
      if (!roles) return roles.error();
      entry.roles = *roles;
    } else if (key == "name") {
      entry.name = text;
    } else if (key == "sha256") {
      if (!IsDigest(text)) {
        return InvalidArgument(At(place, value) + "sha256 must have 64 digits 0-9 a-f", key);
      }
      entry.sha256 = text;
    } else if (key == "expires") {
      entry.expires = ParseTime(text);
      if (!entry.expires) {
        return InvalidArgument(At(place, value) + "expires is \"" + text +
                                   "\", must be like 2027-01-31 or 2027-01-31T08:00:00Z",
                               key);
      }
    } else if (key == "speaks_for_others") {
      if (text != "true" && text != "false") {
        return InvalidArgument(At(place, value) + key + " must be true or false", key);
      }
      entry.speaks_for_others = text == "true";
    } else {
      return InvalidArgument(At(place, pair.first) + "there is no key \"" + key + '"', key);
    }
  }
  if (!IsName(entry.name)) {
    return InvalidArgument(At(place, node) + "name is \"" + entry.name +
                               "\", must have 1 to 64 of the letters, digits and . _ - @",
                           "name");
  }
  return entry;
}

Status ParseEntries(const YAML::Node& node, const std::string& place, bool tokens,
                    std::vector<AccessEntry>& entries) {
  if (node.IsNull()) return {};
  if (!node.IsSequence()) return InvalidArgument(At(place, node) + "must be a list of entries");
  for (const YAML::Node& each : node) {
    const Result<AccessEntry> entry = ParseEntry(each, place);
    if (!entry) return entry.error();
    if (tokens && entry->sha256.empty()) {
      return InvalidArgument(At(place, each) + "the token of " + entry->name + " has no sha256",
                             "sha256");
    }
    entries.push_back(*entry);
  }
  return {};
}

void WriteEntries(std::ostream& out, const char* key, const std::vector<AccessEntry>& entries) {
  out << key << ":\n";
  for (const AccessEntry& entry : entries) {
    out << "  - name: " << entry.name << '\n';
    if (!entry.sha256.empty()) out << "    sha256: " << entry.sha256 << '\n';
    std::vector<std::string> roles;
    for (const Role role : kRoles) {
      if (entry.roles.Has(role)) roles.emplace_back(ToString(role));
    }
    if (entry.roles.Has(Role::kAdminister)) roles = {"administer"};
    out << "    roles: [" << Join(roles, ", ") << "]\n";
    if (entry.expires) {
      out << "    expires: " << ToIso8601(*entry.expires).substr(0, 19) << "Z\n";
    }
    if (entry.speaks_for_others) out << "    speaks_for_others: true\n";
  }
}

/// Looks at every entry, so that the time does not tell which one it was.
const AccessEntry* FindToken(const AccessList& list, std::string_view token) {
  const std::string digest = Sha256Hex(token);
  const AccessEntry* found = nullptr;
  for (const AccessEntry& entry : list.tokens) {
    if (EqualInConstantTime(entry.sha256, digest)) found = &entry;
  }
  return found;
}

const AccessEntry* FindCertificate(const AccessList& list, const Presented& who) {
  for (const AccessEntry& entry : list.certificates) {
    if (entry.name == who.certificate_name &&
        (entry.sha256.empty() || EqualInConstantTime(entry.sha256, who.certificate_sha256))) {
      return &entry;
    }
  }
  return nullptr;
}

bool IsOver(const AccessEntry& entry, Stamp now) { return entry.expires && *entry.expires <= now; }

}  // namespace

std::optional<Stamp> ParseTime(std::string_view text) {
  std::array<int, 6> numbers{};
  constexpr std::string_view kShape = "dddd-dd-ddTdd:dd:ddZ";
  if (text.size() != 10 && text.size() != kShape.size()) return std::nullopt;
  std::size_t part = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (kShape[i] != 'd') {
      if (text[i] != kShape[i]) return std::nullopt;
      ++part;
      continue;
    }
    if (text[i] < '0' || text[i] > '9') return std::nullopt;
    numbers[part] = 10 * numbers[part] + (text[i] - '0');
  }
  using namespace std::chrono;
  const year_month_day date{std::chrono::year{numbers[0]},
                            std::chrono::month{static_cast<unsigned>(numbers[1])},
                            std::chrono::day{static_cast<unsigned>(numbers[2])}};
  if (!date.ok() || numbers[0] < 1970 || numbers[0] > 2200 || numbers[3] > 23 || numbers[4] > 59 ||
      numbers[5] > 59) {
    return std::nullopt;
  }
  const nanoseconds since = sys_days(date).time_since_epoch() + hours(numbers[3]) +
                            minutes(numbers[4]) + seconds(numbers[5]);
  return Stamp::FromNanoseconds(since.count());
}

Result<AccessList> ParseAccessList(const std::string& yaml, const std::string& place) {
  try {
    const YAML::Node root = YAML::Load(yaml);
    AccessList list;
    if (root.IsNull()) return list;
    if (!root.IsMap()) return InvalidArgument(place + ": must have tokens and certificates");
    for (const auto& pair : root) {
      const std::string key = pair.first.Scalar();
      if (key != "tokens" && key != "certificates") {
        return InvalidArgument(
            At(place, pair.first) + "there is no key \"" + key + "\", only tokens and certificates",
            key);
      }
      const bool tokens = key == "tokens";
      const Status read =
          ParseEntries(pair.second, place, tokens, tokens ? list.tokens : list.certificates);
      if (!read) return read.error();
    }
    return list;
  } catch (const YAML::Exception& e) {
    return InvalidArgument(place + ":" + std::to_string(e.mark.line + 1) + ": " + e.msg);
  }
}

std::string ToYaml(const AccessList& list) {
  std::ostringstream out;
  out << "# Who may call what; written by `exemplar security`. docs/security.md says how.\n";
  WriteEntries(out, "tokens", list.tokens);
  WriteEntries(out, "certificates", list.certificates);
  return out.str();
}

Status WriteAccessList(const std::filesystem::path& file, const AccessList& list) {
  const std::string part = file.string() + ".part";
  const std::string text = ToYaml(list);
  // A file that exists keeps its owner and mode: a service of another user may read it.
  struct stat old {};
  const bool exists = ::stat(file.c_str(), &old) == 0;
  ::unlink(part.c_str());
  const int fd = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (fd < 0) return InvalidArgument(part + ": cannot be written", "access");
  bool written = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (exists) {
    written = ::fchmod(fd, old.st_mode & 0777) == 0 && written;
    // Only an administrator may give a file away; for others it is theirs already.
    if (::geteuid() == 0) written = ::fchown(fd, old.st_uid, old.st_gid) == 0 && written;
  }
  written = ::fsync(fd) == 0 && written;
  ::close(fd);
  std::error_code error;
  if (written) std::filesystem::rename(part, file, error);
  if (!written || error) return InvalidArgument(file.string() + ": cannot be written", "access");
  return {};
}

Result<AccessList> ReadAccessList(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in.is_open() || in.bad()) {
    return InvalidArgument("access file " + file.string() + " cannot be read", "access");
  }
  return ParseAccessList(text.str(), file.string());
}

Result<Caller> Identify(const AccessList& list, const Presented& who, Stamp now) {
  const AccessEntry* entry = nullptr;
  if (!who.token.empty()) {
    entry = FindToken(list, who.token);
    if (entry == nullptr) return Unauthenticated("the token is not known here", "token");
    if (IsOver(*entry, now)) return Unauthenticated("the token has expired", "token");
  } else if (!who.certificate_name.empty()) {
    entry = FindCertificate(list, who);
    if (entry == nullptr) {
      return Unauthenticated(
          "the certificate of " + std::string(who.certificate_name) + " has no access here",
          "certificate");
    }
    if (IsOver(*entry, now)) {
      return Unauthenticated("the access of " + entry->name + " has expired", "certificate");
    }
  } else {
    return Unauthenticated("this server wants a token (--token) or a certificate", "token");
  }
  if (who.for_whom.empty()) return Caller{entry->name, entry->roles};
  if (!entry->speaks_for_others) {
    return PermissionDenied(entry->name + " may not speak for others", "caller");
  }
  RoleSet roles;
  bool known = false;
  for (const std::vector<AccessEntry>* entries : {&list.tokens, &list.certificates}) {
    for (const AccessEntry& other : *entries) {
      if (known || other.name != who.for_whom || IsOver(other, now)) continue;
      roles = other.roles;
      known = true;
    }
  }
  if (!known) {
    return Unauthenticated("he whom " + entry->name + " speaks for is unknown here", "caller");
  }
  return Caller{std::string(who.for_whom) + " via " + entry->name, roles};
}

AccessFile::Signature AccessFile::SignatureOf(const std::filesystem::path& file) {
  struct stat now {};
  if (::stat(file.c_str(), &now) != 0) return {};
  return {now.st_mtim.tv_sec * 1'000'000'000 + now.st_mtim.tv_nsec, now.st_ino, now.st_size};
}

Result<std::unique_ptr<AccessFile>> AccessFile::Open(std::filesystem::path file, const Clock& clock,
                                                     Log& log) {
  std::unique_ptr<AccessFile> access(new AccessFile(std::move(file), clock, log));
  access->signature_ = SignatureOf(access->file_);
  Result<AccessList> list = ReadAccessList(access->file_);
  if (!list) return list.error();
  access->list_ = std::move(*list);
  return access;
}

Result<Caller> AccessFile::Identify(const Presented& who) {
  const std::lock_guard lock(mutex_);
  if (const Signature now = SignatureOf(file_); now != signature_) {
    signature_ = now;
    Result<AccessList> list = ReadAccessList(file_);
    if (list) {
      list_ = std::move(*list);
      log_.Info("access file read again", {{"file", file_.string()}});
    } else {
      log_.Error("access file not read again, its old entries stay in force",
                 {{"error", list.error().message}});
    }
  }
  return security::Identify(list_, who, clock_.Now());
}

}  // namespace exemplar::security
