#include "exchange.hpp"

#include <exception>
#include <utility>

#include "origin.hpp"
#include "upgrade.hpp"

namespace exemplar::http {
namespace {

namespace beast_http = boost::beast::http;

std::optional<Method> MethodOf(beast_http::verb verb) {
  switch (verb) {
    case beast_http::verb::get:
      return Method::kGet;
    case beast_http::verb::head:
      return Method::kHead;
    case beast_http::verb::post:
      return Method::kPost;
    case beast_http::verb::put:
      return Method::kPut;
    case beast_http::verb::patch:
      return Method::kPatch;
    case beast_http::verb::delete_:
      return Method::kDelete;
    case beast_http::verb::options:
      return Method::kOptions;
    default:
      return std::nullopt;
  }
}

std::string_view View(boost::beast::string_view text) { return {text.data(), text.size()}; }

std::string ListOf(const std::vector<Method>& methods) {
  std::string list;
  for (const Method method : methods) {
    list += (list.empty() ? "" : ", ") + std::string(ToString(method));
    if (method == Method::kGet) list += ", HEAD";
  }
  return list;
}

Response Plain(int status, std::string text) {
  return {status, {{"Content-Type", "text/plain; charset=utf-8"}}, std::move(text) + "\n"};
}

/// Why this request cannot become a WebSocket.
std::optional<Response> RefuseUpgrade(Core& core, Decision& decision) {
  const auto& endpoint = std::get<WebSocketEndpoint>(decision.route->handler);
  const std::optional<std::string> subprotocol =
      ChooseSubprotocol(endpoint, decision.request.headers.Get("Sec-WebSocket-Protocol"));
  if (!subprotocol) {
    std::string known;
    for (const std::string& name : endpoint.subprotocols) known += " " + name;
    return Plain(400, "no subprotocol in common; here are:" + known);
  }
  if (*decision.route->clients >= endpoint.clients || core.stopping) {
    return Plain(503, "too many clients");
  }
  decision.subprotocol = *subprotocol;
  decision.upgrade = true;
  return std::nullopt;
}

std::optional<Response> Refuse(Core& core, const RequestHead& head, bool wants_websocket,
                               Decision& decision) {
  Request& request = decision.request;
  const std::optional<Method> method = MethodOf(head.method());
  if (!method) return Plain(501, "this method is not known here");
  request.method = *method;
  Result<Target> target = ParseTarget(request.target);
  if (!target.ok()) {
    ++core.counters.bad_requests;
    return ErrorAnswer(target.error());
  }
  request.query = std::move(target->query);

  const std::string* origin = request.headers.Find("Origin");
  if (origin != nullptr) {
    if (!MayUse(core.options.origins, *origin, request.headers.Get("Host"), request.tls)) {
      ++core.counters.refused_origins;
      return Plain(403, "pages of " + *origin + " may not use this server");
    }
    decision.extra.Add("Access-Control-Allow-Origin", *origin);
    decision.extra.Add("Vary", "Origin");
  }
  Routes::Found found = core.routes.Find(request.method, target->segments, wants_websocket);
  if (request.method == Method::kOptions && found.route == nullptr && !found.methods.empty()) {
    Response preflight{204, {{"Allow", ListOf(found.methods)}}};
    preflight.headers.Add("Access-Control-Allow-Methods", ListOf(found.methods));
    preflight.headers.Add("Access-Control-Allow-Headers", "Authorization, Content-Type");
    preflight.headers.Add("Access-Control-Max-Age", "600");
    return preflight;
  }
  if (found.route == nullptr) {
    ++core.counters.refused_requests;
    if (found.methods.empty()) return ErrorAnswer(NotFound("nothing is at " + request.path));
    Response refusal = Plain(405, "here are only " + ListOf(found.methods));
    refusal.headers.Add("Allow", ListOf(found.methods));
    return refusal;
  }
  decision.route = found.route;
  request.variables = std::move(found.variables);
  if (core.options.gate && !found.route->options.open) {
    if (std::optional<Response> refusal = core.options.gate(request)) {
      ++core.counters.refused_requests;
      return refusal;
    }
  }
  if (!std::holds_alternative<WebSocketEndpoint>(found.route->handler)) return std::nullopt;
  std::optional<Response> refusal;
  if (wants_websocket) {
    refusal = RefuseUpgrade(core, decision);
  } else {
    refusal = Plain(426, "this speaks WebSocket only");
    refusal->headers.Add("Upgrade", "websocket");
  }
  if (refusal) ++core.counters.refused_requests;
  return refusal;
}

}  // namespace

Decision Decide(Core& core, const RequestHead& head, bool wants_websocket, std::string peer,
                bool tls, std::string certificate_subject) {
  ++core.counters.requests;
  Decision decision;
  Request& request = decision.request;
  request.target = View(head.target());
  request.path = request.target.substr(0, request.target.find('?'));
  request.peer = std::move(peer);
  request.tls = tls;
  request.certificate_subject = std::move(certificate_subject);
  for (const auto& field : head) {
    request.headers.Add(std::string(View(field.name_string())), std::string(View(field.value())));
  }
  decision.refusal = Refuse(core, head, wants_websocket, decision);
  return decision;
}

beast_http::response<beast_http::empty_body> HeadOf(int status, const Headers& headers,
                                                    const Headers& extra, unsigned version) {
  beast_http::response<beast_http::empty_body> head;
  head.version(version);
  head.result(static_cast<unsigned>(status));
  head.set(beast_http::field::server, "exemplar");
  head.set("X-Content-Type-Options", "nosniff");
  for (const Headers* fields : {&headers, &extra}) {
    for (const auto& field : fields->fields()) head.insert(field.first, field.second);
  }
  return head;
}

bool RunHandler(Core& core, const RouteEntry& route, std::shared_ptr<Request> request,
                std::function<void(Response)> done) {
  const auto run = [&core, &route, request = std::move(request), done = std::move(done)] {
    Response response;
    try {
      response = std::get<Handler>(route.handler)(*request);
    } catch (const std::exception& problem) {
      core.log.Error("a handler failed",
                     {{"path", route.pattern.text()}, {"what", problem.what()}});
      response = ErrorAnswer(Internal("the server failed at this"));
    }
    if (response.status >= 500) ++core.counters.handler_failures;
    done(std::move(response));
  };
  if (!route.options.quick) return core.pool->Run(run);
  run();
  return true;
}

}  // namespace exemplar::http
