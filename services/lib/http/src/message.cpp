#include "exemplar/http/message.hpp"

#include <algorithm>
#include <array>

namespace exemplar::http {
namespace {

char Lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool SameName(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return Lower(x) == Lower(y); });
}

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const char lower = Lower(c);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

/// Without percent signs; nullopt for a broken escape or a control character.
std::optional<std::string> Decode(std::string_view text, bool plus_is_space) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const int high = HexDigit(text[i + 1]);
      const int low = HexDigit(text[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(high * 16 + low);
      i += 2;
    } else if (c == '+' && plus_is_space) {
      c = ' ';
    }
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) return std::nullopt;
    decoded.push_back(c);
  }
  return decoded;
}

std::vector<std::string_view> Pieces(std::string_view text, char separator) {
  std::vector<std::string_view> pieces;
  while (true) {
    const std::size_t end = text.find(separator);
    pieces.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return pieces;
    text.remove_prefix(end + 1);
  }
}

Error BadTarget(std::string_view text, std::string_view what) {
  constexpr std::size_t kShown = 80;
  return InvalidArgument(
      "target \"" + std::string(text.substr(0, kShown)) + "\": " + std::string(what), "target");
}

std::string EscapedForJson(std::string_view text) {
  static constexpr char kHex[] = "0123456789abcdef";
  std::string escaped;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      escaped += {'\\', c};
    } else if (byte < 0x20) {
      escaped += "\\u00";
      escaped += {kHex[byte >> 4], kHex[byte & 15]};
    } else {
      escaped.push_back(c);
    }
  }
  return escaped;
}

}  // namespace

std::string_view ToString(Method method) {
  static constexpr std::array<std::string_view, 7> kNames = {"GET",   "HEAD",   "POST",   "PUT",
                                                             "PATCH", "DELETE", "OPTIONS"};
  return kNames[static_cast<std::size_t>(method)];
}

const std::string* Headers::Find(std::string_view name) const {
  for (const auto& field : fields_) {
    if (SameName(field.first, name)) return &field.second;
  }
  return nullptr;
}

std::string Headers::Get(std::string_view name) const {
  const std::string* found = Find(name);
  return found != nullptr ? *found : std::string();
}

void Headers::Set(std::string_view name, std::string value) {
  std::erase_if(fields_, [&](const auto& field) { return SameName(field.first, name); });
  fields_.emplace_back(name, std::move(value));
}

Result<Target> ParseTarget(std::string_view text) {
  if (text.empty() || text.front() != '/') return BadTarget(text, "does not begin with '/'");
  const std::size_t mark = text.find('?');
  Target target;
  for (const std::string_view piece : Pieces(text.substr(1, mark - 1), '/')) {
    std::optional<std::string> segment = Decode(piece, false);
    if (!segment) return BadTarget(text, "a broken escape or a control character in the path");
    if (*segment == "." || *segment == "..") return BadTarget(text, "a dot segment");
    target.segments.push_back(std::move(*segment));
  }
  if (mark == std::string_view::npos || mark + 1 == text.size()) return target;
  for (const std::string_view piece : Pieces(text.substr(mark + 1), '&')) {
    if (piece.empty()) continue;
    const std::size_t equals = piece.find('=');
    std::optional<std::string> name = Decode(piece.substr(0, equals), true);
    std::optional<std::string> value =
        equals == std::string_view::npos ? "" : Decode(piece.substr(equals + 1), true);
    if (!name || !value) {
      return BadTarget(text, "a broken escape or a control character in the query");
    }
    target.query.emplace_back(std::move(*name), std::move(*value));
  }
  return target;
}

Result<PathPattern> PathPattern::Parse(std::string_view text) {
  const auto bad = [&](std::string_view what) {
    return InvalidArgument("pattern \"" + std::string(text) + "\": " + std::string(what),
                           "pattern");
  };
  if (text.empty() || text.front() != '/') return bad("does not begin with '/'");
  PathPattern pattern;
  pattern.text_ = text;
  for (const std::string_view piece : Pieces(text.substr(1), '/')) {
    if (!pattern.segments_.empty() && pattern.segments_.back().rest) {
      return bad("** is not at the end");
    }
    const std::size_t open = piece.find('{');
    const std::size_t close = piece.find('}');
    Segment segment;
    segment.before = piece.substr(0, open);
    if (open == std::string_view::npos) {
      if (close != std::string_view::npos) return bad("a brace that was not opened");
    } else {
      if (close == std::string_view::npos || close < open) return bad("a brace is not closed");
      std::string_view name = piece.substr(open + 1, close - open - 1);
      segment.after = piece.substr(close + 1);
      if (segment.after.find('{') != std::string::npos) return bad("two variables in a segment");
      if (name.ends_with("=**")) {
        segment.rest = true;
        name.remove_suffix(3);
      }
      if (name.empty()) return bad("a variable without name");
      segment.name = name;
      for (const Segment& other : pattern.segments_) {
        if (other.name == segment.name) return bad("a variable stands twice");
      }
    }
    pattern.segments_.push_back(std::move(segment));
  }
  return pattern;
}

std::optional<std::map<std::string, std::string>> PathPattern::Match(
    const std::vector<std::string>& segments) const {
  std::map<std::string, std::string> variables;
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    const Segment& wanted = segments_[i];
    if (i >= segments.size()) return std::nullopt;
    std::string given = segments[i];
    if (wanted.rest) {
      for (std::size_t k = i + 1; k < segments.size(); ++k) given += "/" + segments[k];
    }
    if (wanted.name.empty()) {
      if (given != wanted.before) return std::nullopt;
      continue;
    }
    if (given.size() <= wanted.before.size() + wanted.after.size() ||
        !given.starts_with(wanted.before) || !given.ends_with(wanted.after)) {
      return std::nullopt;
    }
    variables[wanted.name] = given.substr(
        wanted.before.size(), given.size() - wanted.before.size() - wanted.after.size());
    if (wanted.rest) return variables;
  }
  if (segments.size() != segments_.size()) return std::nullopt;
  return variables;
}

std::size_t PathPattern::variables() const {
  return static_cast<std::size_t>(std::count_if(segments_.begin(), segments_.end(),
                                                [](const Segment& s) { return !s.name.empty(); }));
}

const std::string* Request::Query(std::string_view name) const {
  for (const auto& parameter : query) {
    if (parameter.first == name) return &parameter.second;
  }
  return nullptr;
}

Response Answer(std::string body, std::string content_type) {
  return {200, {{"Content-Type", std::move(content_type)}}, std::move(body)};
}

Response ErrorAnswer(const Error& error) {
  std::string body = "{\"code\": \"" + std::string(ToString(error.code)) + "\", \"message\": \"" +
                     EscapedForJson(error.message) + "\"";
  if (!error.field.empty()) body += ", \"field\": \"" + EscapedForJson(error.field) + "\"";
  return {StatusOf(error.code), {{"Content-Type", "application/json"}}, body + "}\n"};
}

int StatusOf(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
      return 400;
    case ErrorCode::kNotFound:
      return 404;
    case ErrorCode::kAlreadyExists:
      return 409;
    case ErrorCode::kFailedPrecondition:
      return 412;
    case ErrorCode::kUnavailable:
      return 503;
    case ErrorCode::kResourceExhausted:
      return 429;
    case ErrorCode::kDeadlineExceeded:
      return 504;
    case ErrorCode::kCancelled:
      return 499;
    case ErrorCode::kUnauthenticated:
      return 401;
    case ErrorCode::kPermissionDenied:
      return 403;
    case ErrorCode::kUnimplemented:
      return 501;
    case ErrorCode::kDataLoss:
    case ErrorCode::kInternal:
      break;
  }
  return 500;
}

}  // namespace exemplar::http
