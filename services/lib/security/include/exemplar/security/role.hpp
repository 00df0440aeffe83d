#pragma once
// What a caller may do.

#include <array>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

namespace exemplar::security {

/// Every role but kObserve includes kObserve; kAdminister includes all.
enum class Role {
  kObserve,     ///< look at trials, skills, states and topics; ask skills; stop the robot
  kRecord,      ///< steer the recorder
  kTeach,       ///< submit and delete trials, learn, choose versions
  kExecute,     ///< plan, move the robot, teleoperate
  kAdminister,  ///< delete skills, publish on any topic
};

inline constexpr std::array kRoles = {Role::kObserve, Role::kRecord, Role::kTeach, Role::kExecute,
                                      Role::kAdminister};

/// "observe", "record", "teach", "execute", "administer".
std::string_view ToString(Role role);
std::optional<Role> ParseRole(std::string_view name);

/// Some roles.
class RoleSet {
 public:
  constexpr RoleSet() = default;
  constexpr RoleSet(std::initializer_list<Role> roles) {
    for (const Role role : roles) Add(role);
  }
  static constexpr RoleSet All() { return {Role::kAdminister}; }

  constexpr void Add(Role role) {
    bits_ |= Bit(role) | Bit(Role::kObserve);
    if (role == Role::kAdminister) {
      for (const Role each : kRoles) bits_ |= Bit(each);
    }
  }
  constexpr bool Has(Role role) const { return (bits_ & Bit(role)) != 0; }
  friend constexpr bool operator==(RoleSet, RoleSet) = default;

 private:
  static constexpr unsigned Bit(Role role) { return 1U << static_cast<unsigned>(role); }
  unsigned bits_ = 0;
};

/// "observe record", or "none".
std::string ToText(RoleSet roles);

}  // namespace exemplar::security
