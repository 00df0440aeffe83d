// Certificates, permissions and tokens of a station, on the machine that keeps its authority: no
// server is asked.

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/security/station.hpp"
#include "exemplar/security/station_role.hpp"
#include "screen.hpp"

namespace exemplar::cli {
namespace {

struct Words {
  std::string folder;
  std::string name;
  std::string station = "default";
  std::string role;
  std::string format;
  std::vector<std::string> hosts;
  std::vector<std::string> calls;
  std::optional<double> days;
};

Result<security::RoleSet> ParseRoles(const std::vector<std::string>& names) {
  security::RoleSet roles;
  for (const std::string& name : names) {
    const std::optional<security::Role> role = security::ParseRole(name);
    if (!role) {
      return InvalidArgument(
          "\"" + name + "\" is none of observe, record, teach, execute, administer", "role");
    }
    roles.Add(*role);
  }
  return roles;
}

int Init(const Words& words) {
  const Status made =
      security::InitStation({.folder = words.folder,
                             .station = words.station,
                             .days = words.days.value_or(security::InitRequest().days)},
                            SystemClock().Now());
  if (!made) return Fail(made.error());
  const std::string authority = words.folder + "/authority";
  const std::string access = words.folder + "/access.yaml";
  if (words.format == "json") {
    Print({{"station", words.station}, {"authority", authority}, {"access", access}});
  } else {
    std::cout << "authority of station " << words.station << ": " << authority
              << " (ca.key stays on this machine)\naccess file for --access: " << access << '\n';
  }
  return 0;
}

int Issue(const Words& words) {
  security::IssueRequest request{.folder = words.folder,
                                 .name = words.name,
                                 .role = words.role,
                                 .hosts = words.hosts,
                                 .days = words.days.value_or(security::IssueRequest().days)};
  if (!words.calls.empty()) {
    const Result<security::RoleSet> calls = ParseRoles(words.calls);
    if (!calls) return FailUsage(calls.error());
    request.calls = *calls;
  }
  const auto folder = security::IssueMember(request, SystemClock().Now());
  if (!folder) return Fail(folder.error());
  const security::MemberFiles files = security::FilesOf(*folder);
  if (words.format == "json") {
    Print({{"name", words.name},
           {"security", folder->string()},
           {"tls_cert", files.certificate.string()},
           {"tls_key", files.key.string()},
           {"tls_ca", files.authority.string()}});
    return 0;
  }
  std::cout << "--security " << folder->string() << " --tls-cert " << files.certificate.string()
            << " --tls-key " << files.key.string() << " --tls-ca " << files.authority.string()
            << '\n';
  return 0;
}

int Revoke(const Words& words) {
  const Status revoked = security::RevokeMember(words.folder, words.name, SystemClock().Now());
  if (!revoked) return Fail(revoked.error());
  if (words.format == "json") {
    Print({{"revoked", words.name}});
    return 0;
  }
  std::cout << words.name << " is revoked: copy access.yaml, and crl.pem of each member's folder, "
            << "to their machines.\nServers take access.yaml at once; programs with --security "
            << "read crl.pem when they start again.\n";
  return 0;
}

int Token(const Words& words) {
  constexpr double kDays = 90;
  const Result<security::RoleSet> roles = ParseRoles(words.calls);
  if (!roles) return FailUsage(roles.error());
  const Result<std::string> token = security::AddToken(
      words.folder, words.name, *roles, words.days.value_or(kDays), SystemClock().Now());
  if (!token) return Fail(token.error());
  if (words.format == "json") {
    Print({{"name", words.name}, {"token", *token}});
  } else {
    std::cout << *token << '\n';
  }
  return 0;
}

int List(const Words& words) {
  const auto members = security::ListMembers(words.folder);
  if (!members) return Fail(members.error());
  const Stamp now = SystemClock().Now();
  nlohmann::json list = nlohmann::json::array();
  Table table({"MEMBER", "ROLE", "UNTIL", "DAYS LEFT", "SERIAL"});
  std::vector<std::string> ending;
  for (const security::MemberInfo& member : *members) {
    const std::string until = ToIso8601(member.not_after).substr(0, 19) + "Z";
    const double days = std::floor(security::DaysLeft(member.not_after, now));
    list.push_back({{"name", member.name},
                    {"role", member.role},
                    {"until", until},
                    {"days_left", days},
                    {"serial", member.serial}});
    table.Add({member.name, member.role, until, FormatDouble(days), member.serial});
    if (days < security::kFewDays) ending.push_back(member.name);
  }
  if (words.format == "json") {
    Print(list);
    return 0;
  }
  std::cout << table.Text();
  if (!ending.empty()) {
    std::cerr << "near the end or past it: " << Join(ending, ", ")
              << "; issue them again, and start their programs with the new files\n";
  }
  return 0;
}

}  // namespace

void AddSecurityCommands(Command& root) {
  Command group = root.Add(
      "security", "Certificates, permissions and tokens of a station; docs/security.md says how");
  const auto add = [&group](const char* name, const char* summary,
                            const std::vector<std::string>& examples, int (*action)(const Words&)) {
    const auto words = std::make_shared<Words>();
    Command command = group.Add(name, summary, examples);
    command.Argument("FOLDER", words->folder, "of the station's files").Completes(Names::kFolders);
    AddFormat(command, words->format, {"text", "json"});
    command.Runs([words, action] { return action(*words); });
    return std::pair{command, words};
  };

  auto [init, init_words] = add("init", "Makes a station's authority, which signs all else",
                                {"exemplar security init station --station lab"}, Init);
  init.Option("--station", "NAME", init_words->station, "as programs have it in --station");
  init.Option("--days", "DAYS", init_words->days, "how long the authority lives (default: 3650)");

  auto [issue, issue_words] =
      add("issue", "Makes a member's certificate, for DDS and gRPC, with its role's permissions",
          {"exemplar security issue station executor --role executor --host robot-pc.lab",
           "exemplar security issue station anna --role person --call teach --call execute"},
          Issue);
  issue.Argument("NAME", issue_words->name, "of the member; one that exists gets a new one");
  issue.Option("--role", "ROLE", issue_words->role, "what it does on the network")
      .Required()
      .OneOf(security::StationRoleNames());
  issue.Option("--host", "HOST", issue_words->hosts,
               "name or address where its gRPC server is found, beside localhost");
  issue.Option("--call", "ROLE", issue_words->calls,
               "what it may call over gRPC: observe, record, teach, execute, administer (default: "
               "as its role needs)");
  issue.Option("--days", "DAYS", issue_words->days, "how long it counts (default: 365)");

  auto [revoke, revoke_words] = add("revoke", "Takes a member's certificate or token back",
                                    {"exemplar security revoke station anna"}, Revoke);
  revoke.Argument("NAME", revoke_words->name, "of the member or the token");

  auto [token, token_words] =
      add("token", "Makes a token for --token, and prints it this once",
          {"exemplar security token station ben --role record --days 30"}, Token);
  token.Argument("NAME", token_words->name, "whose it is; an older one of the name ends");
  token.Option("--role", "ROLE", token_words->calls, "observe, record, teach, execute, administer")
      .Required();
  token.Option("--days", "DAYS", token_words->days, "how long it counts (default: 90; 0: always)");

  add("list", "Members and until when their certificates count", {"exemplar security list station"},
      List);
}

}  // namespace exemplar::cli
