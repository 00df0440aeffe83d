#pragma once
// Logins of browsers: cookies in place of tokens, and proof that a request comes from our own page.

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "exemplar/base/clock.hpp"

namespace exemplar::security {

/// Sessions of people who showed a token. A session keeps the token, in memory only, so that every
/// request is judged by the access file as it is then: what is revoked is revoked here as well.
/// Thread-safe.
class LoginSessions {
 public:
  struct Limits {
    Duration idle = std::chrono::minutes(30);  ///< without a request
    Duration longest = std::chrono::hours(12);
    std::size_t sessions = 1000;  ///< at once; beyond that the one longest idle goes
  };
  /// The clock outlives it.
  LoginSessions(const Clock& clock, Limits limits) : clock_(clock), limits_(limits) {}
  explicit LoginSessions(const Clock& clock) : LoginSessions(clock, Limits()) {}

  struct Opened {
    std::string id;    ///< the cookie's value
    std::string csrf;  ///< what our page sends in the header X-CSRF-Token
  };
  /// Always a new id: one that an attacker planted is worth nothing. Precondition: the token was
  /// found good.
  Opened Open(std::string token);

  struct Session {
    std::string token;
    std::string csrf;
  };
  /// Nothing for an id that is none or has ended; else the session lives on.
  std::optional<Session> Find(std::string_view id);
  void Close(std::string_view id);

 private:
  struct Kept {
    Session session;
    Duration opened{0};
    Duration used{0};
  };
  bool IsOver(const Kept& kept, Duration now) const {
    return now - kept.used > limits_.idle || now - kept.opened > limits_.longest;
  }

  const Clock& clock_;
  const Limits limits_;
  std::mutex mutex_;
  std::map<std::string, Kept, std::less<>> sessions_;  ///< by the id's hash
};

/// The value of Set-Cookie. Over TLS the name begins with "__Host-", which browsers give back to
/// this very host alone; in plain text (loopback) it cannot.
std::string SessionCookie(std::string_view id, bool tls);
/// The value of Set-Cookie that ends it.
std::string EndedSessionCookie(bool tls);
/// The session's id in a Cookie header; empty when there is none.
std::string_view SessionIdOf(std::string_view cookies, bool tls);

}  // namespace exemplar::security
