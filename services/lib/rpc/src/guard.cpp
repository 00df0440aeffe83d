#include "guard.hpp"

#include <grpc/grpc_security_constants.h>
#include <grpcpp/security/auth_context.h>

#include "convert_common.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/rpc/metadata.hpp"
#include "exemplar/security/certificate.hpp"
#include "tls.hpp"

namespace exemplar::rpc {
namespace {

std::string_view Metadata(const grpc::ServerContextBase& context, const char* name) {
  const auto found = context.client_metadata().find(name);
  if (found == context.client_metadata().end()) return {};
  return {found->second.data(), found->second.size()};
}

/// The token of "authorization: Bearer TOKEN".
std::string_view BearerToken(const grpc::ServerContextBase& context) {
  constexpr std::string_view kScheme = "Bearer ";
  const std::string_view value = Metadata(context, kAuthorizationKey);
  return value.starts_with(kScheme) ? value.substr(kScheme.size()) : std::string_view();
}

std::string Property(const grpc::ServerContextBase& context, const char* name) {
  const auto values = context.auth_context()->FindPropertyValues(name);
  return values.empty() ? std::string() : std::string(values[0].data(), values[0].size());
}

/// "10.0.0.7" of "ipv4:10.0.0.7:40312".
std::string HostOfPeer(const std::string& peer) {
  const std::size_t begin = peer.find(':') + 1;
  const std::size_t end = peer.rfind(':');
  return end > begin ? peer.substr(begin, end - begin) : peer;
}

bool IsLocalPeer(const std::string& peer) {
  // Calls of a gateway's own HTTP side come from within the process.
  const bool inside = peer == "inproc" || peer == "unknown";
  return inside || peer.starts_with("unix:") || peer.starts_with("ipv4:127.") ||
         peer.starts_with("ipv6:%5B::1%5D") || peer.starts_with("ipv6:[::1]");
}

Refusal Refused(const Error& error) { return {ToString(error.code), error}; }

Refusal TooOften(const std::string& who) {
  return {"rate_limited",
          Error{ErrorCode::kResourceExhausted, who + " calls too often; wait and try again"}};
}

}  // namespace

Guard::Guard(const ServerOptions& options)
    : options_(options), limiter_(options.credentials.calls_per_s, clock_) {}

Status Guard::Open() {
  if (options_.credentials.access.empty()) return {};
  Log& log = options_.log != nullptr ? *options_.log : null_log_;
  auto access = security::AccessFile::Open(options_.credentials.access, clock_, log);
  if (!access) return access.error();
  access_ = std::move(*access);
  return {};
}

Result<security::Caller> Guard::Identify(const grpc::ServerContextBase& context) {
  const std::string name = Property(context, GRPC_X509_CN_PROPERTY_NAME);
  if (!access_) return security::Caller{Utf8(name, 64), security::RoleSet::All()};
  const std::string pem = Property(context, GRPC_X509_PEM_CERT_PROPERTY_NAME);
  std::string digest;
  if (!pem.empty()) {
    const auto facts = security::ReadCertificate(pem, "the caller's certificate");
    if (facts) digest = facts->sha256;
  }
  return access_->Identify({.token = BearerToken(context),
                            .certificate_name = name,
                            .certificate_sha256 = digest,
                            .for_whom = Metadata(context, kForWhomKey)});
}

Admission Guard::Admit(const grpc::ServerContextBase& context, std::string_view method,
                       const MethodRule* rule) {
  if (rule == nullptr) {
    return {{}, Refused(PermissionDenied(std::string(method) + " has no rule who may call it"))};
  }
  const std::string peer = context.peer();
  const Result<security::Caller> caller = Identify(context);
  if (!caller) {
    if (!limiter_.Allow("unknown " + HostOfPeer(peer))) return {{}, TooOften(HostOfPeer(peer))};
    return {{}, Refused(caller.error())};
  }
  if (access_ || !IsLocalPeer(peer)) {
    const std::string& who = caller->name.empty() ? HostOfPeer(peer) : caller->name;
    if (!limiter_.Allow(who)) return {caller->name, TooOften(who)};
  }
  if (!caller->roles.Has(rule->role)) {
    return {caller->name, Refused(PermissionDenied(
                              caller->name + " may not call " + std::string(method) +
                                  ": that takes the role " + std::string(ToString(rule->role)) +
                                  ", and " + caller->name + " has " + ToText(caller->roles),
                              "role"))};
  }
  return {caller->name, std::nullopt};
}

CallDeadlines::CallDeadlines(Duration longest) : longest_(longest) {
  if (longest_ > Duration::zero()) {
    thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  }
}

CallDeadlines::Watch::Watch(CallDeadlines& deadlines, grpc::ServerContext& context)
    : deadlines_(deadlines), context_(context) {
  const std::lock_guard lock(deadlines_.mutex_);
  const bool first = deadlines_.watches_.empty();
  place_ = deadlines_.watches_.emplace(deadlines_.clock_.Steady() + deadlines_.longest_, this);
  // All have the same length: a later one never ends before those that are waited for.
  if (first) deadlines_.added_.notify_one();
}

CallDeadlines::Watch::~Watch() {
  const std::lock_guard lock(deadlines_.mutex_);
  if (!fired_) deadlines_.watches_.erase(place_);
}

bool CallDeadlines::Watch::fired() const {
  const std::lock_guard lock(deadlines_.mutex_);
  return fired_;
}

void CallDeadlines::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (added_.wait(lock, stop, [this] { return !watches_.empty(); })) {
    const auto next = watches_.begin();
    const Duration wait = next->first - clock_.Steady();
    if (wait > Duration::zero()) {
      added_.wait_for(lock, stop, wait, [] { return false; });
      continue;
    }
    Watch& watch = *next->second;
    watches_.erase(next);
    watch.fired_ = true;
    // The lock keeps the call, which ends its watch first, from going meanwhile.
    watch.context_.TryCancel();
  }
}

}  // namespace exemplar::rpc
