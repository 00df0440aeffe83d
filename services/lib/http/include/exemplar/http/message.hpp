#pragma once
// HTTP requests and answers as values.

#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::http {

enum class Method { kGet, kHead, kPost, kPut, kPatch, kDelete, kOptions };

/// "GET".
std::string_view ToString(Method method);

/// Header fields in their order; names compare without case. Thread-compatible.
class Headers {
 public:
  Headers() = default;
  Headers(std::initializer_list<std::pair<std::string, std::string>> fields) : fields_(fields) {}

  /// The first value of that name; nullptr when there is none.
  const std::string* Find(std::string_view name) const;
  std::string Get(std::string_view name) const;  ///< empty when there is none
  void Add(std::string name, std::string value) {
    fields_.emplace_back(std::move(name), std::move(value));
  }
  /// Replaces every value of that name.
  void Set(std::string_view name, std::string value);
  const std::vector<std::pair<std::string, std::string>>& fields() const { return fields_; }

 private:
  std::vector<std::pair<std::string, std::string>> fields_;
};

/// Where a request points: a path and a query, percent-decoded.
struct Target {
  std::vector<std::string> segments;  ///< "/a/b%2Fc" is {"a", "b/c"}; "/" is {""}
  std::vector<std::pair<std::string, std::string>> query;

  friend bool operator==(const Target&, const Target&) = default;
};

/// Reads the target of a request line ("/v1/skills/press?limit=3").
/// Errors: kInvalidArgument for a target that does not begin with '/', a broken escape, a control
/// character, or a "." or ".." segment.
Result<Target> ParseTarget(std::string_view text);

/// A pattern of paths. A segment is literal text, `{name}`, or a variable with literal text around
/// it (`{name}:query`); `{name=**}` at the end takes all segments that are left, with '/' between.
class PathPattern {
 public:
  /// kInvalidArgument: no leading '/', a brace that does not close, two variables in a segment, a
  /// name twice, or `**` not at the end.
  static Result<PathPattern> Parse(std::string_view text);

  /// The variables' values, or nullopt when the path is not of this pattern.
  std::optional<std::map<std::string, std::string>> Match(
      const std::vector<std::string>& segments) const;
  /// How many segments hold a variable; of two patterns that match, the one with fewer is meant.
  std::size_t variables() const;
  const std::string& text() const { return text_; }

 private:
  struct Segment {
    std::string before;  ///< literal
    std::string name;    ///< of the variable; empty: none
    std::string after;   ///< literal
    bool rest = false;   ///< takes all that follows
  };
  std::string text_;
  std::vector<Segment> segments_;
};

/// A request that a route has taken.
struct Request {
  Method method = Method::kGet;
  std::string target;  ///< as sent
  std::string path;    ///< of it, as sent, without the query
  std::vector<std::pair<std::string, std::string>> query;
  std::map<std::string, std::string> variables;  ///< of the route's pattern
  Headers headers;
  std::string body;
  std::string peer;  ///< the client's address, without port
  bool tls = false;
  std::string certificate_subject;  ///< of a client's certificate, RFC 2253; empty: none
  std::string identity;             ///< who the gate says that it is
  /// Stopped when the client has gone or the server stops; a handler that waits ends then.
  std::stop_token gone;

  /// The first value of a query parameter; nullptr when there is none.
  const std::string* Query(std::string_view name) const;
};

struct Response {
  int status = 200;
  Headers headers = {};
  std::string body = {};
};

/// An answer of `content_type`.
Response Answer(std::string body, std::string content_type = "text/plain; charset=utf-8");
/// {"code": "not_found", "message": ..., "field": ...} with the HTTP status of the error's code.
Response ErrorAnswer(const Error& error);
/// The HTTP status that says the same: 400, 401, 403, 404, 409, 412, 429, 499, 500, 501, 503, 504.
int StatusOf(ErrorCode code);

}  // namespace exemplar::http
