#include "exemplar/security/station_role.hpp"

#include <algorithm>

namespace exemplar::security {

std::span<const StationRole> StationRoles() {
  static const std::vector<StationRole> kTable = {
      {.name = "capture",
       .writes = {"ircp/suit", "ircp/end_effector", "ircp/tactile", "ircp/camera", "ircp/objects",
                  "ircp/safety", "ircp/clock", "ircp/capture_*/status", "ircp/recorder/command",
                  "ircp/simulator/command"},
       .reads = {"ircp/joint_state", "ircp/camera", "ircp/objects", "ircp/clock",
                 "ircp/capture_*/command", "ircp/capture_*/status", "ircp/recorder/status",
                 "ircp/simulator/status"}},
      {.name = "recorder",
       .writes = {"ircp/clock", "ircp/recorder/status"},
       .reads = {"*"},
       .serves = true},
      {.name = "learning", .writes = {}, .reads = {}, .serves = true},
      {.name = "executor",
       .writes = {"ircp/joint_command", "ircp/plan", "ircp/clock", "ircp/executor/status"},
       .reads = {"ircp/joint_state", "ircp/objects", "ircp/safety", "ircp/suit",
                 "ircp/end_effector", "ircp/tactile", "ircp/clock", "ircp/executor/command",
                 "ircp/executor/status"},
       .calls = {Role::kObserve},
       .serves = true},
      {.name = "robot",
       .writes = {"ircp/joint_state", "ircp/camera", "ircp/objects", "ircp/tactile", "ircp/clock",
                  "ircp/driver/status", "ircp/simulator/status"},
       .reads = {"ircp/joint_command", "ircp/suit", "ircp/end_effector", "ircp/clock",
                 "ircp/driver/command", "ircp/driver/status", "ircp/simulator/command",
                 "ircp/simulator/status"}},
      {.name = "pendant",
       .writes = {"ircp/safety", "ircp/clock", "ircp/pendant/status"},
       .reads = {"ircp/clock", "ircp/executor/status", "ircp/pendant/command",
                 "ircp/pendant/status"}},
      {.name = "gateway",
       .writes = {"ircp/suit", "ircp/end_effector", "ircp/tactile", "ircp/objects", "ircp/safety",
                  "ircp/clock", "ircp/gateway/status"},
       .reads = {"*"},
       .calls = {Role::kObserve},
       .speaks_for_others = true,
       .serves = true},
      {.name = "observer", .writes = {}, .reads = {"*"}, .calls = {Role::kObserve}},
      {.name = "person", .writes = {}, .reads = {}},
  };
  return kTable;
}

const StationRole* FindStationRole(std::string_view name) {
  const auto roles = StationRoles();
  const auto found = std::find_if(roles.begin(), roles.end(),
                                  [&](const StationRole& role) { return role.name == name; });
  return found == roles.end() ? nullptr : &*found;
}

std::vector<std::string> StationRoleNames() {
  std::vector<std::string> names;
  for (const StationRole& role : StationRoles()) names.emplace_back(role.name);
  return names;
}

}  // namespace exemplar::security
