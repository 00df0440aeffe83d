#pragma once
// What each gRPC method asks of its callers: the one table.

#include <span>
#include <string_view>

#include "exemplar/security/role.hpp"

namespace exemplar::rpc {

enum class CallLength {
  kShort,  ///< cancelled after ServerOptions::max_call
  kLong,   ///< as long as its work, or as the caller wants
};

struct MethodRule {
  std::string_view method;  ///< "exemplar.v1.SkillService/Query"
  security::Role role;
  CallLength length = CallLength::kShort;
  bool audited = false;  ///< moves the robot, deletes, or takes all data out
};

/// All methods of package exemplar.v1; the health service and reflection ask for no role.
std::span<const MethodRule> MethodRules();
/// Null for a method that is not in the table: it is refused.
const MethodRule* RuleOf(std::string_view method);

}  // namespace exemplar::rpc
