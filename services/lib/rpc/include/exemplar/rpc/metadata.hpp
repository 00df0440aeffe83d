#pragma once
// Names of the metadata (headers) that calls carry beside their message.

namespace exemplar::rpc {

/// "Bearer TOKEN".
inline constexpr const char* kAuthorizationKey = "authorization";
/// The caller's name for this call, in logs and audit lines of every service on its way.
inline constexpr const char* kRequestIdKey = "x-request-id";
/// Whom a gateway speaks for: a name of the access file (AccessEntry::speaks_for_others).
inline constexpr const char* kForWhomKey = "x-exemplar-for";

}  // namespace exemplar::rpc
