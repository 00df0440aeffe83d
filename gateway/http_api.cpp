#include "gateway/http_api.hpp"

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "exemplar/base/text.hpp"

namespace exemplar::gateway {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kRequestId = "X-Request-Id";
constexpr const char* kJson = "application/json";
constexpr const char* kJsonLines = "application/x-ndjson";

std::string ToText(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json ErrorObject(const api::JsonFailure& failure) {
  Json error = {{"code", failure.code}, {"message", failure.message}};
  if (!failure.field.empty()) error["field"] = failure.field;
  return error;
}

http::Response FailureAnswer(const api::JsonFailure& failure, const std::string& request_id) {
  return {failure.http_status,
          {{"Content-Type", kJson}, {kRequestId, request_id}},
          ToText(ErrorObject(failure)) + "\n"};
}

/// Header fields that go along with the call.
constexpr std::string_view kPassedOn[] = {"authorization", "traceparent", "tracestate"};

/// What of a request makes a call.
Result<api::JsonCall> CallOf(const HttpApi& api, const std::string& method,
                             const http::Request& request) {
  api::JsonCall call{.method = method, .body = request.body, .fields = request.query};
  call.timeout = api.timeout;
  call.stop = request.gone;
  if (const std::string* text = request.headers.Find("Connect-Timeout-Ms")) {
    const std::optional<long long> timeout_ms = ParseInteger(*text);
    constexpr long long kMost = 24LL * 3600 * 1000;
    if (!timeout_ms || *timeout_ms < 1 || *timeout_ms > kMost) {
      return InvalidArgument("Connect-Timeout-Ms is \"" + *text +
                                 "\", must be a whole number from 1 to " + std::to_string(kMost),
                             "Connect-Timeout-Ms");
    }
    call.timeout = std::chrono::milliseconds(*timeout_ms);
  }
  for (const std::string_view name : kPassedOn) {
    if (const std::string* value = request.headers.Find(name)) {
      call.metadata.emplace_back(name, *value);
    }
  }
  std::string id = request.headers.Get(kRequestId);
  constexpr std::size_t kLongestId = 128;
  if (id.empty() || id.size() > kLongestId) id = api.make_request_id();
  call.metadata.emplace_back("x-request-id", std::move(id));
  return call;
}

/// A call that answers once.
http::Response Ask(const HttpApi& api, const std::string& method, const http::Request& request) {
  const Result<api::JsonCall> call = CallOf(api, method, request);
  if (!call) return http::ErrorAnswer(call.error());
  const std::string& id = call->metadata.back().second;
  std::string body;
  const std::optional<api::JsonFailure> failure = api.calls->Call(*call, [&](std::string&& json) {
    body = std::move(json);
    return true;
  });
  if (failure) return FailureAnswer(*failure, id);
  return {200, {{"Content-Type", kJson}, {kRequestId, id}}, body + "\n"};
}

/// A call that answers with a stream: a line each.
void Listen(const HttpApi& api, const std::string& method, const http::Request& request,
            http::Stream& stream) {
  const auto refuse = [&stream](const http::Response& response) {
    stream.Begin(response.status, response.headers);
    stream.Write(response.body);
  };
  const Result<api::JsonCall> call = CallOf(api, method, request);
  if (!call) return refuse(http::ErrorAnswer(call.error()));
  const std::string& id = call->metadata.back().second;
  bool begun = false;
  const auto begin = [&] {
    if (!begun) stream.Begin(200, {{"Content-Type", kJsonLines}, {kRequestId, id}});
    begun = true;
  };
  const std::optional<api::JsonFailure> failure = api.calls->Call(*call, [&](std::string&& json) {
    begin();
    json += '\n';
    return stream.Write(json);
  });
  if (failure && !begun) return refuse(FailureAnswer(*failure, id));
  begin();
  // The status has gone out already: the last line says it.
  if (failure) stream.Write(ToText({{"error", ErrorObject(*failure)}}) + "\n");
}

http::Response HealthAnswer(const HttpApi& api) {
  bool all = true;
  Json backends = Json::array();
  for (const HealthLine& line : api.health()) {
    all = all && line.serving;
    backends.push_back({{"name", line.name}, {"address", line.address}, {"serving", line.serving}});
  }
  const Json health = {{"status", all ? "ok" : "degraded"}, {"backends", std::move(backends)}};
  return http::Answer(ToText(health) + "\n", kJson);
}

Status AddCall(http::Server& server, const HttpApi& api, const api::JsonMethod& method,
               http::Method verb) {
  const std::string name = method.service + "/" + method.name;
  const http::RouteOptions options{.body_bytes = method.client_streaming ? api.stream_body_bytes
                                                                         : api.body_bytes};
  if (!method.server_streaming) {
    return server.Route(
        verb, "/" + name,
        [api, name](const http::Request& request) { return Ask(api, name, request); }, options);
  }
  return server.RouteStream(
      verb, "/" + name,
      [api, name](const http::Request& request, http::Stream& stream) {
        Listen(api, name, request, stream);
      },
      options);
}

}  // namespace

Status AddRoutes(http::Server& server, const HttpApi& api) {
  Status added = server.Route(http::Method::kGet, "/healthz",
                              [api](const http::Request&) { return HealthAnswer(api); },
                              {.quick = true, .open = true});
  if (!added) return added;
  added = server.Route(http::Method::kGet, "/metrics", [api](const http::Request&) {
    return http::Answer(api.metrics(), "text/plain; version=0.0.4");
  });
  if (!added || api.calls == nullptr) return added;
  added = server.Route(http::Method::kGet, "/openapi.json",
                       [document = api.calls->OpenApi()](const http::Request&) {
                         return http::Answer(document, kJson);
                       });
  for (const api::JsonMethod& method : api.calls->methods()) {
    if (added) added = AddCall(server, api, method, http::Method::kPost);
    const bool may_get = method.read_only && !method.client_streaming;
    if (added && may_get) added = AddCall(server, api, method, http::Method::kGet);
  }
  return added;
}

}  // namespace exemplar::gateway
