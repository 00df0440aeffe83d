#pragma once
// Who may use the gateway's HTTP and WebSocket: tokens for programs, logins for browsers.

#include <memory>
#include <optional>
#include <string>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/http/server.hpp"
#include "exemplar/security/access.hpp"
#include "exemplar/security/login.hpp"
#include "exemplar/security/rate_limit.hpp"

namespace exemplar::gateway {

/// Asks the access file about every request: "Authorization: Bearer TOKEN" of programs, `?token=`
/// of WebSockets (browsers give these no headers), or the cookie of a login. What a cookie lets in
/// must, where it changes something, carry the session's X-CSRF-Token as well. A request that may
/// pass has the caller's `identity` and its token as Authorization, so that the services behind
/// judge it, too. Thread-safe.
class Door {
 public:
  /// `clock` and `log` outlive it.
  static Result<std::unique_ptr<Door>> Open(const std::string& access_file, const Clock& clock,
                                            Log& log);

  /// The answer to a request that may not pass. For http::ServerOptions::gate.
  std::optional<http::Response> Judge(http::Request& request);

  /// GET /login (a page), POST /login (the token as JSON or as a form, which leads to "/"),
  /// GET /session (who it is, and the CSRF token), POST /logout.
  Status AddRoutes(http::Server& server);

 private:
  Door(std::unique_ptr<security::AccessFile> access, const Clock& clock, Log& log)
      : access_(std::move(access)), sessions_(clock), attempts_(1, clock), log_(log) {}
  http::Response LogIn(const http::Request& request);
  http::Response LogOut(const http::Request& request);
  http::Response Tell(const http::Request& request);

  std::unique_ptr<security::AccessFile> access_;
  security::LoginSessions sessions_;
  security::RateLimiter attempts_;  ///< that failed, of each address
  Log& log_;
};

}  // namespace exemplar::gateway
