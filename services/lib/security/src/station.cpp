#include "exemplar/security/station.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>

#include "exemplar/base/text.hpp"
#include "exemplar/base/xml.hpp"
#include "exemplar/security/access.hpp"
#include "exemplar/security/certificate.hpp"
#include "exemplar/security/dds_documents.hpp"
#include "exemplar/security/digest.hpp"
#include "exemplar/security/station_role.hpp"

namespace exemplar::security {
namespace {

namespace fs = std::filesystem;

// Clocks of a station's machines may differ so much.
constexpr auto kClockTolerance = std::chrono::hours(1);
constexpr double kLongestDays = 36500;

Validity FromNow(double days, Stamp now) {
  return {now - kClockTolerance, now + FromSeconds(days * 86400)};
}

Status CheckDays(double days) {
  if (days > 0 && days <= kLongestDays) return {};
  return InvalidArgument("--days is " + FormatDouble(days) + ", must be over 0 and at most 36500",
                         "days");
}

/// Names become folders, subjects and lines of XML and YAML.
Status CheckName(const std::string& what, const std::string& name) {
  const auto fits = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_'; };
  if (!name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), fits)) return {};
  return InvalidArgument(
      what + " \"" + name + "\" must have 1 to 64 of the letters, digits and - _", what);
}

Result<std::string> ReadText(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in.is_open() || in.bad()) return NotFound(file.string() + " cannot be read", "folder");
  return std::move(text).str();
}

/// Whole or not at all.
Status WriteText(const fs::path& file, const std::string& text, mode_t mode) {
  const std::string part = file.string() + ".part";
  ::unlink(part.c_str());
  const int fd = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (fd < 0) return InvalidArgument(part + " cannot be written", "folder");
  bool written = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  written = ::fsync(fd) == 0 && written;
  ::close(fd);
  std::error_code error;
  if (written) fs::rename(part, file, error);
  if (!written || error) return InvalidArgument(file.string() + " cannot be written", "folder");
  return {};
}

constexpr mode_t kSecret = 0600;
constexpr mode_t kPublic = 0644;

struct Authority {
  KeyPair pair;
  std::string station;
};

Result<Authority> OpenAuthority(const fs::path& folder) {
  Authority authority;
  for (const auto& [name, text] :
       {std::pair{"ca.pem", &authority.pair.certificate}, std::pair{"ca.key", &authority.pair.key},
        std::pair{"station.yaml", &authority.station}}) {
    Result<std::string> read = ReadText(folder / "authority" / name);
    if (!read) {
      return NotFound(folder.string() + " holds no station's authority (" + read.error().message +
                          "); `exemplar security init` makes one",
                      "folder");
    }
    *text = std::move(*read);
  }
  try {
    authority.station = YAML::Load(authority.station)["station"].as<std::string>();
  } catch (const YAML::Exception& e) {
    return InvalidArgument((folder / "authority/station.yaml").string() + ": " + e.msg);
  }
  return authority;
}

std::vector<fs::path> Folders(const fs::path& parent) {
  std::vector<fs::path> folders;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(parent, error)) {
    if (entry.is_directory()) folders.push_back(entry.path());
  }
  std::sort(folders.begin(), folders.end());
  return folders;
}

/// Writes the list of what is revoked into every member's folder.
Status SpreadRevocations(const fs::path& folder, const Authority& authority, Stamp now) {
  std::vector<Revoked> revoked;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder / "revoked", error)) {
    const Result<std::string> pem = ReadText(entry.path());
    if (!pem) return pem.error();
    const Result<CertificateFacts> facts = ReadCertificate(*pem, entry.path().string());
    if (!facts) return facts.error();
    revoked.push_back({facts->serial, now});
  }
  const Result<CertificateFacts> ca = ReadCertificate(authority.pair.certificate, "ca.pem");
  if (!ca) return ca.error();
  const Result<std::string> list =
      MakeRevocationList(authority.pair, revoked, {now - kClockTolerance, ca->not_after});
  if (!list) return list.error();
  for (const fs::path& member : Folders(folder / "members")) {
    if (Status written = WriteText(FilesOf(member).revocations, *list, kPublic); !written) {
      return written;
    }
  }
  return {};
}

Result<AccessList> ReadAccess(const fs::path& folder) {
  return ReadAccessList(folder / "access.yaml");
}

/// The role that a member's folder was made for.
Result<std::string> RoleOf(const fs::path& member) {
  try {
    return YAML::LoadFile((member / "member.yaml").string())["role"].as<std::string>();
  } catch (const YAML::Exception& e) {
    return InvalidArgument((member / "member.yaml").string() + ": " + e.msg);
  }
}

/// Whoever was given the folder goes on being able to read what is new in it.
Status GiveToOwner(const fs::path& file) {
  struct stat owner {};
  if (::stat(file.parent_path().c_str(), &owner) == 0 && owner.st_uid != ::geteuid() &&
      ::chown(file.c_str(), owner.st_uid, owner.st_gid) != 0) {
    return FailedPrecondition(file.string() + " cannot be given to the folder's owner", "folder");
  }
  return {};
}

/// The station's access file, and the copies of those that are called.
Status WriteAccess(const fs::path& folder, const AccessList& access) {
  if (Status written = WriteAccessList(folder / "access.yaml", access); !written) return written;
  for (const fs::path& member : Folders(folder / "members")) {
    const Result<std::string> name = RoleOf(member);
    if (!name) return name.error();
    const StationRole* role = FindStationRole(*name);
    if (role == nullptr || !role->serves) continue;
    if (Status written = WriteAccessList(member / "access.yaml", access); !written) return written;
    if (Status given = GiveToOwner(member / "access.yaml"); !given) return given;
  }
  return {};
}

void Forget(std::vector<AccessEntry>& entries, const std::string& name) {
  std::erase_if(entries, [&](const AccessEntry& entry) { return entry.name == name; });
}

/// The certificate goes to those that count no more. False: there is none.
Result<bool> Retire(const fs::path& folder, const std::string& name) {
  const fs::path certificate = FilesOf(folder / "members" / name).certificate;
  if (!fs::exists(certificate)) return false;
  const Result<std::string> pem = ReadText(certificate);
  if (!pem) return pem.error();
  const Result<CertificateFacts> facts = ReadCertificate(*pem, certificate.string());
  if (!facts) return facts.error();
  std::error_code error;
  fs::create_directories(folder / "revoked", error);
  if (Status kept = WriteText(folder / "revoked" / (facts->serial + ".pem"), *pem, kPublic);
      !kept) {
    return kept.error();
  }
  return true;
}

Status WriteMember(const fs::path& member, const Authority& authority, const KeyPair& pair,
                   const StationRole& role, Validity validity) {
  const Result<CertificateFacts> facts = ReadCertificate(pair.certificate, "cert.pem");
  if (!facts) return facts.error();
  const Result<std::string> governance = SignDocument(authority.pair, GovernanceXml());
  if (!governance) return governance.error();
  const Result<std::string> permissions =
      SignDocument(authority.pair, PermissionsXml({.subject = facts->subject,
                                                   .station = authority.station,
                                                   .writes = role.writes,
                                                   .reads = role.reads,
                                                   .validity = validity}));
  if (!permissions) return permissions.error();
  const MemberFiles files = FilesOf(member);
  const std::string info =
      "station: " + authority.station + "\nrole: " + std::string(role.name) + "\n";
  for (const auto& [file, text, mode] :
       {std::tuple{files.key, &pair.key, kSecret},
        std::tuple{files.certificate, &pair.certificate, kPublic},
        std::tuple{files.authority, &authority.pair.certificate, kPublic},
        std::tuple{files.governance, &*governance, kPublic},
        std::tuple{files.permissions, &*permissions, kPublic},
        std::tuple{member / "member.yaml", &info, kPublic}}) {
    if (Status written = WriteText(file, *text, mode); !written) return written;
    if (Status given = GiveToOwner(file); !given) return given;
  }
  return {};
}

/// A signed text as it was before signing, which may change how its lines end.
std::string Unsigned(std::string text) {
  std::erase(text, '\r');
  return std::string(Trim(text));
}

}  // namespace

MemberFiles FilesOf(const fs::path& folder) {
  return {.certificate = folder / "cert.pem",
          .key = folder / "key.pem",
          .authority = folder / "ca.pem",
          .revocations = folder / "crl.pem",
          .governance = folder / "governance.p7s",
          .permissions = folder / "permissions.p7s"};
}

Status InitStation(const InitRequest& request, Stamp now) {
  if (Status named = CheckName("station", request.station); !named) return named;
  if (Status lives = CheckDays(request.days); !lives) return lives;
  const fs::path authority = request.folder / "authority";
  if (fs::exists(authority)) {
    return Error{ErrorCode::kAlreadyExists,
                 authority.string() +
                     " exists: a new authority would make all that the old one "
                     "signed worthless; remove the folder to begin anew",
                 "folder"};
  }
  const Result<KeyPair> pair =
      MakeAuthority(request.station, request.station + " authority", FromNow(request.days, now));
  if (!pair) return pair.error();
  std::error_code error;
  fs::create_directories(request.folder / "members", error);
  if (!error) fs::create_directories(authority, error);
  if (error) return InvalidArgument(authority.string() + ": " + error.message(), "folder");
  fs::permissions(authority, fs::perms::owner_all, error);
  const std::string info = "station: " + request.station + "\n";
  for (const auto& [name, text, mode] : {std::tuple{"ca.key", &pair->key, kSecret},
                                         std::tuple{"ca.pem", &pair->certificate, kPublic},
                                         std::tuple{"station.yaml", &info, kPublic}}) {
    if (Status written = WriteText(authority / name, *text, mode); !written) return written;
  }
  return WriteAccessList(request.folder / "access.yaml", {});
}

Result<fs::path> IssueMember(const IssueRequest& request, Stamp now) {
  if (Status named = CheckName("name", request.name); !named) return named.error();
  if (Status lives = CheckDays(request.days); !lives) return lives.error();
  const StationRole* role = FindStationRole(request.role);
  if (role == nullptr) {
    return InvalidArgument(
        "role \"" + request.role + "\" is none of " + Join(StationRoleNames(), ", "), "role");
  }
  const Result<Authority> authority = OpenAuthority(request.folder);
  if (!authority) return authority.error();
  std::vector<std::string> hosts = {"localhost", "127.0.0.1"};
  hosts.insert(hosts.end(), request.hosts.begin(), request.hosts.end());
  const Validity validity = FromNow(request.days, now);
  const Result<KeyPair> pair = IssueCertificate(
      authority->pair,
      {.organisation = authority->station, .name = request.name, .hosts = std::move(hosts)},
      validity);
  if (!pair) return pair.error();
  const Result<CertificateFacts> facts = ReadCertificate(pair->certificate, request.name);
  if (!facts) return facts.error();
  Result<AccessList> access = ReadAccess(request.folder);
  if (!access) return access.error();

  if (const Result<bool> retired = Retire(request.folder, request.name); !retired) {
    return retired.error();
  }
  const fs::path member = request.folder / "members" / request.name;
  std::error_code error;
  fs::create_directories(member, error);
  if (error) return InvalidArgument(member.string() + ": " + error.message(), "folder");
  fs::permissions(member, fs::perms::owner_all, error);
  if (Status written = WriteMember(member, *authority, *pair, *role, validity); !written) {
    return written.error();
  }
  Forget(access->certificates, request.name);
  access->certificates.push_back({.name = request.name,
                                  .sha256 = facts->sha256,
                                  .roles = request.calls.value_or(role->calls),
                                  .speaks_for_others = role->speaks_for_others});
  if (Status written = WriteAccess(request.folder, *access); !written) {
    return written.error();
  }
  if (Status spread = SpreadRevocations(request.folder, *authority, now); !spread) {
    return spread.error();
  }
  return member;
}

Status RevokeMember(const fs::path& folder, const std::string& name, Stamp now) {
  if (Status named = CheckName("name", name); !named) return named;
  const Result<Authority> authority = OpenAuthority(folder);
  if (!authority) return authority.error();
  Result<AccessList> access = ReadAccess(folder);
  if (!access) return access.error();
  const std::size_t before = access->tokens.size();
  Forget(access->tokens, name);
  Forget(access->certificates, name);
  const Result<bool> retired = Retire(folder, name);
  if (!retired) return retired.error();
  if (!*retired && access->tokens.size() == before) {
    return NotFound(
        "there is neither a member nor a token of \"" + name + "\" in " + folder.string(), "name");
  }
  std::error_code error;
  fs::remove_all(folder / "members" / name, error);
  if (Status written = WriteAccess(folder, *access); !written) return written;
  return SpreadRevocations(folder, *authority, now);
}

Result<std::string> AddToken(const fs::path& folder, const std::string& name, RoleSet roles,
                             double days, Stamp now) {
  if (Status named = CheckName("name", name); !named) return named.error();
  if (days != 0) {
    if (Status lives = CheckDays(days); !lives) return lives.error();
  }
  if (const Result<Authority> authority = OpenAuthority(folder); !authority) {
    return authority.error();
  }
  Result<AccessList> access = ReadAccess(folder);
  if (!access) return access.error();
  const std::string token = MakeToken();
  Forget(access->tokens, name);
  AccessEntry entry{.name = name, .sha256 = Sha256Hex(token), .roles = roles};
  if (days > 0) entry.expires = FromNow(days, now).to;
  access->tokens.push_back(std::move(entry));
  if (Status written = WriteAccess(folder, *access); !written) {
    return written.error();
  }
  return token;
}

Result<std::vector<MemberInfo>> ListMembers(const fs::path& folder) {
  if (const Result<Authority> authority = OpenAuthority(folder); !authority) {
    return authority.error();
  }
  std::vector<MemberInfo> members;
  for (const fs::path& member : Folders(folder / "members")) {
    const Result<std::string> pem = ReadText(FilesOf(member).certificate);
    if (!pem) return pem.error();
    const Result<CertificateFacts> facts = ReadCertificate(*pem, member.string());
    if (!facts) return facts.error();
    const Result<std::string> role = RoleOf(member);
    if (!role) return role.error();
    members.push_back({member.filename().string(), *role, facts->not_after, facts->serial});
  }
  return members;
}

Status CheckMemberFolder(const fs::path& folder, const std::string& station, Stamp now) {
  const MemberFiles files = FilesOf(folder);
  if (Status pair = CheckKeyPair(files.certificate, files.key); !pair) {
    return WithPlace(pair.error(), "--security");
  }
  std::string texts[4];
  const fs::path paths[] = {files.certificate, files.authority, files.governance,
                            files.permissions};
  for (std::size_t i = 0; i < std::size(paths); ++i) {
    Result<std::string> text = ReadText(paths[i]);
    if (!text) return WithPlace(text.error(), "--security");
    texts[i] = std::move(*text);
  }
  if (const auto list = ReadText(files.revocations); !list) {
    return WithPlace(list.error(), "--security");
  }
  const auto& [certificate, authority, governance, permissions] = texts;
  const Result<CertificateFacts> facts = ReadCertificate(certificate, files.certificate.string());
  if (!facts) return facts.error();
  if (facts->not_after <= now || facts->not_before > now) {
    return FailedPrecondition("--security: " + files.certificate.string() + " is valid from " +
                                  ToIso8601(facts->not_before) + " to " +
                                  ToIso8601(facts->not_after) + ", and it is " + ToIso8601(now),
                              "security");
  }
  if (const auto read = VerifyDocument(authority, governance); !read) {
    return WithPlace(read.error(), "--security: " + files.governance.string());
  }
  const Result<std::string> granted = VerifyDocument(authority, permissions);
  if (!granted) return WithPlace(granted.error(), "--security: " + files.permissions.string());
  if (granted->find("<subject_name>" + EscapeXml(facts->subject) + "</subject_name>") ==
      std::string::npos) {
    return FailedPrecondition("--security: " + files.permissions.string() +
                                  " is not about the certificate's " + facts->subject,
                              "security");
  }
  if (granted->find("<partition>") != std::string::npos &&
      granted->find("<partition>" + EscapeXml(station) + "</partition>") == std::string::npos) {
    return FailedPrecondition("--security: " + files.permissions.string() +
                                  " is of another station than \"" + station + '"',
                              "security");
  }
  return {};
}

std::vector<std::string> MemberFolderWarnings(const fs::path& folder, Stamp now) {
  const MemberFiles files = FilesOf(folder);
  std::vector<std::string> warnings;
  for (const auto& [file, remedy] :
       {std::pair{files.certificate, "issue the member again (exemplar security issue)"},
        std::pair{files.authority, "make the station anew (exemplar security init)"}}) {
    const Result<std::string> pem = ReadText(file);
    if (!pem) continue;
    const Result<CertificateFacts> facts = ReadCertificate(*pem, file.string());
    if (!facts) continue;
    const double days = DaysLeft(facts->not_after, now);
    if (days >= kFewDays) continue;
    warnings.push_back(file.string() + " counts until " + ToIso8601(facts->not_after) + ", " +
                       (days > 0 ? "for " + std::to_string(static_cast<int>(days)) + " more days"
                                 : "and so no more") +
                       ": " + remedy);
  }
  const Result<std::string> authority = ReadText(files.authority);
  const Result<std::string> document = ReadText(files.governance);
  if (!authority || !document) return warnings;
  const Result<std::string> governance = VerifyDocument(*authority, *document);
  if (governance && Unsigned(*governance) != Unsigned(GovernanceXml())) {
    warnings.push_back(files.governance.string() +
                       " is another version's: members may not hear those that have this one's, "
                       "and may be less protected; issue all of them again");
  }
  return warnings;
}

double DaysLeft(Stamp not_after, Stamp now) {
  constexpr double kSecondsADay = 86400;
  return ToSeconds(not_after - now) / kSecondsADay;
}

}  // namespace exemplar::security
