#include "exemplar/security/login.hpp"

#include <algorithm>

#include "exemplar/base/text.hpp"
#include "exemplar/security/digest.hpp"

namespace exemplar::security {
namespace {

constexpr std::size_t kSecretBytes = 32;

std::string CookieName(bool tls) { return tls ? "__Host-exemplar" : "exemplar"; }

std::string Cookie(std::string_view id, bool tls) {
  return CookieName(tls) + "=" + std::string(id) + "; Path=/; HttpOnly; SameSite=Strict" +
         (tls ? "; Secure" : "");
}

}  // namespace

LoginSessions::Opened LoginSessions::Open(std::string token) {
  Opened opened{RandomText(kSecretBytes), RandomText(kSecretBytes)};
  const std::lock_guard lock(mutex_);
  const Duration now = clock_.Steady();
  std::erase_if(sessions_, [&](const auto& entry) { return IsOver(entry.second, now); });
  if (sessions_.size() >= limits_.sessions) {
    sessions_.erase(std::min_element(
        sessions_.begin(), sessions_.end(),
        [](const auto& a, const auto& b) { return a.second.used < b.second.used; }));
  }
  sessions_[Sha256Hex(opened.id)] = {{std::move(token), opened.csrf}, now, now};
  return opened;
}

std::optional<LoginSessions::Session> LoginSessions::Find(std::string_view id) {
  const std::lock_guard lock(mutex_);
  const auto found = sessions_.find(Sha256Hex(id));
  if (found == sessions_.end()) return std::nullopt;
  const Duration now = clock_.Steady();
  if (IsOver(found->second, now)) {
    sessions_.erase(found);
    return std::nullopt;
  }
  found->second.used = now;
  return found->second.session;
}

void LoginSessions::Close(std::string_view id) {
  const std::lock_guard lock(mutex_);
  sessions_.erase(Sha256Hex(id));
}

std::string SessionCookie(std::string_view id, bool tls) { return Cookie(id, tls); }

std::string EndedSessionCookie(bool tls) { return Cookie("", tls) + "; Max-Age=0"; }

std::string_view SessionIdOf(std::string_view cookies, bool tls) {
  const std::string name = CookieName(tls) + "=";
  for (const std::string_view part : Split(cookies, ';')) {
    const std::string_view pair = Trim(part);
    if (pair.starts_with(name)) return pair.substr(name.size());
  }
  return {};
}

}  // namespace exemplar::security
