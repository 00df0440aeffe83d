#pragma once
// A station's files: its authority, and for each member a folder with everything that the member
// needs, and nothing that it must not have.
//
//   FOLDER/authority/ca.pem, ca.key     the authority; the key stays where it was made
//   FOLDER/authority/station.yaml       the station's name
//   FOLDER/access.yaml                  who may call what over gRPC (access.hpp)
//   FOLDER/revoked/SERIAL.pem           certificates that count no more
//   FOLDER/members/NAME/                cert.pem, key.pem, ca.pem, crl.pem, governance.p7s,
//                                       permissions.p7s, member.yaml; of those that are called, a
//                                       copy of access.yaml

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"
#include "exemplar/security/role.hpp"

namespace exemplar::security {

/// The files of a member, as programs find them in its folder.
struct MemberFiles {
  std::filesystem::path certificate, key, authority, revocations, governance, permissions;
};
MemberFiles FilesOf(const std::filesystem::path& member_folder);

struct InitRequest {
  std::filesystem::path folder;
  std::string station;  ///< as programs have it in --station
  double days = 3650;   ///< the authority's life
};
/// Errors: a folder that has an authority already.
Status InitStation(const InitRequest& request, Stamp now);

struct IssueRequest {
  std::filesystem::path folder;
  std::string name;                     ///< of the member, unique in the station
  std::string role;                     ///< of station_role.hpp
  std::vector<std::string> hosts = {};  ///< where its gRPC server is found, beside this machine
  double days = 365;
  /// What its certificate may call over gRPC; nothing: as its role has it.
  std::optional<RoleSet> calls = {};
};
/// A new certificate with the role's permissions; a member that exists gets new ones, its old
/// certificate is revoked. Returns the member's folder.
Result<std::filesystem::path> IssueMember(const IssueRequest& request, Stamp now);

/// Takes the certificate back: it stands on the revocation list of every member's folder here, and
/// the access file knows it no more. A name may also be a token's alone.
Status RevokeMember(const std::filesystem::path& folder, const std::string& name, Stamp now);

/// A new token with these roles, in the access file; replaces the name's old one. `days` zero:
/// never expires. Returns the token: it is shown once and kept nowhere.
Result<std::string> AddToken(const std::filesystem::path& folder, const std::string& name,
                             RoleSet roles, double days, Stamp now);

struct MemberInfo {
  std::string name;
  std::string role;
  Stamp not_after;
  std::string serial;
};
Result<std::vector<MemberInfo>> ListMembers(const std::filesystem::path& folder);

/// Whether a participant of this station can be made from a member's folder, and if not, what is
/// wrong with it: Fast DDS itself only says that it cannot.
Status CheckMemberFolder(const std::filesystem::path& member_folder, const std::string& station,
                         Stamp now);

/// A certificate with fewer days left is to be issued again.
inline constexpr double kFewDays = 30;
/// Negative once it counts no more.
double DaysLeft(Stamp not_after, Stamp now);

/// What is wrong soon with a member's folder that is well today: a certificate near its end; or
/// documents of another version of this program. A sentence each.
std::vector<std::string> MemberFolderWarnings(const std::filesystem::path& member_folder,
                                              Stamp now);

}  // namespace exemplar::security
