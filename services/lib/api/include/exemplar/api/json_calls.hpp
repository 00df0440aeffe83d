#pragma once
// The services' calls as JSON, for HTTP: what a client with nothing but curl can make.

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"

namespace exemplar::api {

struct JsonMethod {
  std::string service;  ///< "exemplar.v1.SkillService"
  std::string name;     ///< "Query"
  bool client_streaming = false;
  bool server_streaming = false;
  bool read_only = false;  ///< changes nothing: may be asked with GET
};

struct JsonCall {
  std::string method;  ///< "exemplar.v1.SkillService/Query"
  /// The request as a JSON object, nothing for an empty one; of a call that takes a stream, one
  /// object a line.
  std::string body = {};
  /// Fields of the request beside the body, as paths: {"skill.name", "press"}. Lists take several.
  std::vector<std::pair<std::string, std::string>> fields = {};
  /// Passed on: request id, authorization.
  std::vector<std::pair<std::string, std::string>> metadata = {};
  Duration timeout{0};  ///< 0: none
  std::stop_token stop = {};
};

/// Why a call failed, as HTTP says it.
struct JsonFailure {
  int http_status = 500;
  std::string code = {};  ///< the name of the ErrorCode: "invalid_argument", ...
  std::string message = {};
  std::string field = {};
};

/// Thread-safe.
class JsonCalls {
 public:
  virtual ~JsonCalls() = default;
  virtual const std::vector<JsonMethod>& methods() const = 0;
  /// An OpenAPI 3.0 document of all methods.
  virtual std::string OpenApi() const = 0;
  /// Gives `on_answer` each answer as one line of JSON, without its end; false from it cancels the
  /// call. Returns when the call is over; nullopt: well.
  virtual std::optional<JsonFailure> Call(const JsonCall& call,
                                          const std::function<bool(std::string&&)>& on_answer) = 0;
};

}  // namespace exemplar::api
