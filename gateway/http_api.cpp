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
    constexpr long long kMost = 24 * 3600 * 1000LL;
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

void Serve(const HttpApi& api, const std::string& method, bool lines, const http::Request& request,
           http::Stream& stream) {
  const Result<api::JsonCall> call = CallOf(api, method, request);
  const auto answer = [&stream](const http::Response& response) {
    stream.Begin(response.status, response.headers);
    stream.Write(response.body);
  };
  if (!call) return answer(http::ErrorAnswer(call.error()));
  const std::string& id = call->metadata.back().second;
  bool begun = false;
  const std::optional<api::JsonFailure> failure = api.calls->Call(*call, [&](std::string&& json) {
    if (!begun) {
      stream.Begin(200, {{"Content-Type", lines ? kJsonLines : kJson}, {kRequestId, id}});
      begun = true;
    }
    json += '\n';
    return stream.Write(json);
  });
  if (!failure) {
    if (!begun) stream.Begin(200, {{"Content-Type", kJsonLines}, {kRequestId, id}});
  } else if (!begun) {
    answer(FailureAnswer(*failure, id));
  } else {
    // The status has gone out already: the last line says it.
    stream.Write(ToText({{"error", ErrorObject(*failure)}}) + "\n");
  }
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

Status AddCalls(http::Server& server, const HttpApi& api) {
  for (const api::JsonMethod& method : api.calls->methods()) {
    const std::string name = method.service + "/" + method.name;
    const http::RouteOptions options{.body_bytes = method.client_streaming ? api.stream_body_bytes
                                                                           : api.body_bytes};
    const auto serve = [api, name, lines = method.server_streaming](const http::Request& request,
                                                                    http::Stream& stream) {
      Serve(api, name, lines, request, stream);
    };
    if (Status added = server.RouteStream(http::Method::kPost, "/" + name, serve, options);
        !added) {
      return added;
    }
    if (!method.read_only || method.client_streaming) continue;
    if (Status added = server.RouteStream(http::Method::kGet, "/" + name, serve, options); !added) {
      return added;
    }
  }
  return {};
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
  if (!added) return added;
  return AddCalls(server, api);
}

}  // namespace exemplar::gateway
