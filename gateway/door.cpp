#include "gateway/door.hpp"

#include <nlohmann/json.hpp>

#include "exemplar/base/text.hpp"
#include "exemplar/security/digest.hpp"

namespace exemplar::gateway {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kCsrfHeader = "X-CSRF-Token";
constexpr const char* kJson = "application/json";

constexpr const char* kLoginPage = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Log in: Exemplar</title>
<meta name="viewport" content="width=device-width">
<link rel="stylesheet" href="/login.css"></head>
<body><main><h1>Exemplar</h1><form method="post" action="/login">
<label for="token">Token (<code>exemplar security token</code> makes one)</label>
<input id="token" name="token" type="password" autocomplete="current-password" required autofocus>
<button>Log in</button></form></main></body></html>
)";

constexpr const char* kLoginStyle = R"(:root{color-scheme:light dark}
body{font:16px/1.5 system-ui,sans-serif;margin:0;background:#f4f5f7;color:#1b2430}
main{max-width:24em;margin:16vh auto 0;padding:1.5em;background:#fff;border-radius:12px;box-shadow:0 1px 3px #0003}
h1{font-size:1.3em;margin:0 0 1em}
input,button{font:inherit;padding:.5em .7em;border-radius:8px;border:1px solid #6b7685;box-sizing:border-box;width:100%}
input{margin:.4em 0 1em;background:transparent;color:inherit}
button{background:#1f5fbf;border-color:#1f5fbf;color:#fff;font-weight:600;cursor:pointer}
:focus-visible{outline:3px solid #5b9dff;outline-offset:2px}
@media (prefers-color-scheme:dark){body{background:#10151c;color:#e3e8ef}main{background:#19212b}}
)";

http::Response Said(int status, const std::string& code, const std::string& message) {
  const Json body = {{"code", code}, {"message", message}};
  return {status,
          {{"Content-Type", kJson}, {"Cache-Control", "no-store"}},
          body.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n"};
}

bool ChangesNothing(http::Method method) {
  return method == http::Method::kGet || method == http::Method::kHead ||
         method == http::Method::kOptions;
}

/// The token that a program shows.
std::string TokenOf(const http::Request& request) {
  constexpr std::string_view kScheme = "Bearer ";
  if (const std::string* value = request.headers.Find("Authorization")) {
    return value->starts_with(kScheme) ? value->substr(kScheme.size()) : std::string();
  }
  // In an address a token ends up in histories: only where there is no other way.
  const bool is_socket = request.headers.Find("Upgrade") != nullptr;
  const std::string* token = is_socket ? request.Query("token") : nullptr;
  return token != nullptr ? *token : std::string();
}

std::string SessionId(const http::Request& request) {
  return std::string(security::SessionIdOf(request.headers.Get("Cookie"), request.tls));
}

/// A person who looks for a page, not a program.
bool IsPageRequest(const http::Request& request) {
  return request.method == http::Method::kGet && request.headers.Find("Upgrade") == nullptr &&
         request.headers.Get("Accept").find("text/html") != std::string::npos;
}

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// "token" of a form, application/x-www-form-urlencoded; empty when there is none.
std::string TokenOfForm(const std::string& body) {
  for (const std::string_view pair : Split(body, '&')) {
    constexpr std::string_view kName = "token=";
    if (!pair.starts_with(kName)) continue;
    const std::string_view text = pair.substr(kName.size());
    std::string token;
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] == '%' && i + 2 < text.size() && HexDigit(text[i + 1]) >= 0 &&
          HexDigit(text[i + 2]) >= 0) {
        token += static_cast<char>(16 * HexDigit(text[i + 1]) + HexDigit(text[i + 2]));
        i += 2;
      } else {
        token += text[i] == '+' ? ' ' : text[i];
      }
    }
    return std::string(Trim(token));
  }
  return {};
}

std::string TokenOfJson(const std::string& body) {
  const Json json = Json::parse(body, nullptr, false);
  if (!json.is_object() || !json.contains("token") || !json["token"].is_string()) return {};
  return json["token"].get<std::string>();
}

}  // namespace

Result<std::unique_ptr<Door>> Door::Open(const std::string& access_file, const Clock& clock,
                                         Log& log) {
  auto access = security::AccessFile::Open(access_file, clock, log);
  if (!access) return access.error();
  return std::unique_ptr<Door>(new Door(std::move(*access), clock, log));
}

std::optional<http::Response> Door::Judge(http::Request& request) {
  std::string token = TokenOf(request);
  bool by_cookie = false;
  if (token.empty()) {
    if (const auto session = sessions_.Find(SessionId(request))) {
      by_cookie = true;
      if (!ChangesNothing(request.method) &&
          !security::EqualInConstantTime(request.headers.Get(kCsrfHeader), session->csrf)) {
        return Said(403, "permission_denied",
                    std::string("a request that changes something needs the header ") +
                        kCsrfHeader + " with the csrf of GET /session");
      }
      token = session->token;
    }
  }
  const Result<security::Caller> caller = access_->Identify({.token = token});
  if (!caller) {
    if (by_cookie) sessions_.Close(SessionId(request));
    if (!token.empty() && !attempts_.Allow(request.peer)) {
      return Said(429, "resource_exhausted", "too many tokens that are not known; wait");
    }
    if (IsPageRequest(request)) return http::Response{303, {{"Location", "/login"}}, ""};
    http::Response response = Said(401, "unauthenticated", caller.error().message);
    response.headers.Set("WWW-Authenticate", "Bearer realm=\"exemplar\"");
    return response;
  }
  if (!caller->roles.Has(security::Role::kObserve)) {
    return Said(403, "permission_denied", caller->name + " has no role here");
  }
  request.identity = caller->name;
  request.headers.Set("Authorization", "Bearer " + token);
  return std::nullopt;
}

http::Response Door::LogIn(const http::Request& request) {
  const bool is_form =
      request.headers.Get("Content-Type").find("form-urlencoded") != std::string::npos;
  const std::string token = is_form ? TokenOfForm(request.body) : TokenOfJson(request.body);
  const Result<security::Caller> caller = access_->Identify({.token = token});
  if (!caller) {
    log_.Warning("login refused", {{"peer", request.peer}, {"because", caller.error().message}});
    if (!attempts_.Allow(request.peer)) {
      return Said(429, "resource_exhausted", "too many logins that failed; wait");
    }
    return Said(401, "unauthenticated", caller.error().message);
  }
  const security::LoginSessions::Opened opened = sessions_.Open(token);
  log_.Info("audit", {{"caller", caller->name}, {"method", "login"}, {"peer", request.peer}});
  http::Response response;
  if (is_form) {
    response = {303, {{"Location", "/"}}, ""};
  } else {
    const Json body = {{"name", caller->name}, {"csrf", opened.csrf}};
    response = http::Answer(body.dump() + "\n", kJson);
  }
  response.headers.Set("Set-Cookie", security::SessionCookie(opened.id, request.tls));
  response.headers.Set("Cache-Control", "no-store");
  return response;
}

http::Response Door::LogOut(const http::Request& request) {
  sessions_.Close(SessionId(request));
  http::Response response = http::Answer("{}\n", kJson);
  response.headers.Set("Set-Cookie", security::EndedSessionCookie(request.tls));
  return response;
}

http::Response Door::Tell(const http::Request& request) {
  const auto session = sessions_.Find(SessionId(request));
  Json body = {{"name", request.identity}};
  if (session) body["csrf"] = session->csrf;
  http::Response response = http::Answer(body.dump() + "\n", kJson);
  response.headers.Set("Cache-Control", "no-store");
  return response;
}

Status Door::AddRoutes(http::Server& server) {
  constexpr std::size_t kLoginBytes = 4096;
  Status added =
      server.Route(http::Method::kGet, "/login",
                   [](const http::Request&) {
                     http::Response page = http::Answer(kLoginPage, "text/html; charset=utf-8");
                     page.headers.Set("Content-Security-Policy",
                                      "default-src 'none'; style-src 'self'; form-action 'self'; "
                                      "frame-ancestors 'none'; base-uri 'none'");
                     page.headers.Set("X-Content-Type-Options", "nosniff");
                     // Without any referrer, browsers would send the form with "Origin: null".
                     page.headers.Set("Referrer-Policy", "same-origin");
                     page.headers.Set("Cache-Control", "no-store");
                     return page;
                   },
                   {.quick = true, .open = true});
  if (!added) return added;
  added = server.Route(
      http::Method::kGet, "/login.css",
      [](const http::Request&) { return http::Answer(kLoginStyle, "text/css; charset=utf-8"); },
      {.quick = true, .open = true});
  if (!added) return added;
  added = server.Route(http::Method::kPost, "/login",
                       [this](const http::Request& request) { return LogIn(request); },
                       {.body_bytes = kLoginBytes, .open = true});
  if (!added) return added;
  added = server.Route(http::Method::kGet, "/session",
                       [this](const http::Request& request) { return Tell(request); });
  if (!added) return added;
  return server.Route(http::Method::kPost, "/logout",
                      [this](const http::Request& request) { return LogOut(request); });
}

}  // namespace exemplar::gateway
