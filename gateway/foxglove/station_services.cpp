#include "gateway/foxglove/station_services.hpp"

#include <nlohmann/json.hpp>
#include <utility>

namespace exemplar::gateway::foxglove {
namespace {

using Json = nlohmann::json;

struct Row {
  const char* name;
  const char* service;
  const char* method;
};

constexpr Row kRows[] = {
    {"/recorder/start", "exemplar.v1.RecorderService", "Start"},
    {"/recorder/stop", "exemplar.v1.RecorderService", "Stop"},
    {"/recorder/pause", "exemplar.v1.RecorderService", "Pause"},
    {"/recorder/resume", "exemplar.v1.RecorderService", "Resume"},
    {"/recorder/event", "exemplar.v1.RecorderService", "MarkEvent"},
    {"/recorder/status", "exemplar.v1.RecorderService", "GetStatus"},
    {"/executor/plan", "exemplar.v1.ExecutorService", "Plan"},
    {"/executor/execute", "exemplar.v1.ExecutorService", "Execute"},
    {"/executor/pause", "exemplar.v1.ExecutorService", "Pause"},
    {"/executor/resume", "exemplar.v1.ExecutorService", "Resume"},
    {"/executor/cancel", "exemplar.v1.ExecutorService", "Cancel"},
    {"/executor/stop", "exemplar.v1.ExecutorService", "Stop"},
    {"/executor/reset", "exemplar.v1.ExecutorService", "Reset"},
    {"/executor/speed", "exemplar.v1.ExecutorService", "SetSpeed"},
    {"/executor/status", "exemplar.v1.ExecutorService", "GetStatus"},
};

/// `schema` with what it refers to put in its place; what nests deeper stays open.
Json Resolved(const Json& document, const Json& schema, int depth) {
  constexpr int kDeepest = 8;
  if (schema.is_object() && schema.contains("$ref") && schema["$ref"].is_string()) {
    const std::string where = schema["$ref"].get<std::string>();
    if (depth >= kDeepest || !where.starts_with("#/")) return Json::object();
    const Json::json_pointer pointer(where.substr(1));
    if (!document.contains(pointer)) return Json::object();
    return Resolved(document, document.at(pointer), depth + 1);
  }
  if (!schema.is_structured()) return schema;
  Json resolved = schema;
  for (auto& member : resolved) member = Resolved(document, member, depth + 1);
  return resolved;
}

/// The JSON Schema of what the OpenAPI document has at `pointer`.
std::string SchemaAt(const Json& document, const Json::json_pointer& pointer) {
  if (!document.contains(pointer)) return R"({"type":"object"})";
  return Resolved(document, document.at(pointer), 0).dump();
}

Error ErrorOf(const api::JsonFailure& failure) {
  const std::string field = failure.field.empty() ? "" : " (" + failure.field + ")";
  return {ErrorCode::kInternal, failure.code + ": " + failure.message + field};
}

Result<std::string> Call(api::JsonCalls& calls, const std::string& method, std::string_view request,
                         const http::Request& origin, std::stop_token stop) {
  api::JsonCall call{.method = method, .body = std::string(request), .stop = std::move(stop)};
  if (std::string authorization = AuthorizationOf(origin); !authorization.empty()) {
    call.metadata.emplace_back("authorization", std::move(authorization));
  }
  std::string last = "{}";
  const auto failure = calls.Call(call, [&last](std::string&& answer) {
    last = std::move(answer);
    return true;
  });
  if (failure) return ErrorOf(*failure);
  return last;
}

}  // namespace

std::string AuthorizationOf(const http::Request& request) {
  if (const std::string* header = request.headers.Find("Authorization")) return *header;
  const std::string* token = request.Query("token");
  return token != nullptr ? "Bearer " + *token : std::string();
}

std::vector<Service> StationServices(api::JsonCalls& calls) {
  const Json document = Json::parse(calls.OpenApi(), nullptr, false);
  std::vector<Service> services;
  for (const Row& row : kRows) {
    bool there = false;
    for (const api::JsonMethod& method : calls.methods()) {
      there = there || (method.service == row.service && method.name == row.method);
    }
    if (!there) continue;
    const std::string method = std::string(row.service) + "/" + row.method;
    const Json::json_pointer post = Json::json_pointer("/paths") / ("/" + method) / "post";
    const Json::json_pointer content("/content/application~1json/schema");
    Service service;
    service.info = {static_cast<std::uint32_t>(services.size() + 1), row.name, method,
                    SchemaAt(document, post / "requestBody" / content),
                    SchemaAt(document, post / "responses" / "200" / content)};
    service.call = [&calls, method](std::string_view request, const http::Request& origin,
                                    std::stop_token stop) {
      return Call(calls, method, request, origin, std::move(stop));
    };
    services.push_back(std::move(service));
  }
  return services;
}

}  // namespace exemplar::gateway::foxglove
