#pragma once
// What each kind of member of a station may do on the network: the one table. docs/security.md has
// it; a test compares the two.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/security/role.hpp"

namespace exemplar::security {

struct StationRole {
  std::string_view name;  ///< "executor"
  /// Topics, "*" for any text: "ircp/*/status".
  std::vector<std::string_view> writes;
  std::vector<std::string_view> reads;
  /// What its certificate may call over gRPC.
  RoleSet calls = {};
  bool speaks_for_others = false;  ///< hands on what people ask, in their name
  bool serves = false;             ///< is called, and so needs the access file
};

std::span<const StationRole> StationRoles();
/// Null for a name that is none.
const StationRole* FindStationRole(std::string_view name);
std::vector<std::string> StationRoleNames();

}  // namespace exemplar::security
