#include "exemplar/security/role.hpp"

namespace exemplar::security {

std::string_view ToString(Role role) {
  switch (role) {
    case Role::kObserve:
      return "observe";
    case Role::kRecord:
      return "record";
    case Role::kTeach:
      return "teach";
    case Role::kExecute:
      return "execute";
    case Role::kAdminister:
      return "administer";
  }
  return "observe";
}

std::optional<Role> ParseRole(std::string_view name) {
  for (const Role role : kRoles) {
    if (ToString(role) == name) return role;
  }
  return std::nullopt;
}

std::string ToText(RoleSet roles) {
  std::string text;
  for (const Role role : kRoles) {
    if (!roles.Has(role)) continue;
    if (!text.empty()) text += ' ';
    text += ToString(role);
  }
  return text.empty() ? "none" : text;
}

}  // namespace exemplar::security
