#include "recorder/sample_header.hpp"

namespace exemplar::recorder {
namespace {

constexpr std::size_t kEncapsulation = 4;

std::uint64_t ReadNumber(std::span<const std::uint8_t> bytes, bool little_endian) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    value = (value << 8) | bytes[little_endian ? bytes.size() - 1 - i : i];
  }
  return value;
}

/// Names, and single characters of anything else; comments are passed over.
class Tokens {
 public:
  explicit Tokens(std::string_view text) : text_(text) {}

  /// Empty at the end.
  std::string_view Next() {
    SkipSpace();
    std::size_t length = 0;
    while (length < text_.size() && IsName(text_[length])) ++length;
    if (length == 0 && !text_.empty()) length = 1;
    const std::string_view token = text_.substr(0, length);
    text_.remove_prefix(length);
    return token;
  }

 private:
  static bool IsName(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  }
  void SkipTo(std::string_view end) {
    const std::size_t at = text_.find(end);
    text_.remove_prefix(at == std::string_view::npos ? text_.size() : at + end.size());
  }
  void SkipSpace() {
    while (!text_.empty()) {
      if (text_.front() == ' ' || text_.front() == '\n' || text_.front() == '\t' ||
          text_.front() == '\r') {
        text_.remove_prefix(1);
      } else if (text_.starts_with("//")) {
        SkipTo("\n");
      } else if (text_.starts_with("/*")) {
        SkipTo("*/");
      } else {
        return;
      }
    }
  }

  std::string_view text_;
};

}  // namespace

std::optional<HeaderLayout> ReadHeaderLayout(std::string_view idl, std::string_view type) {
  const std::string_view name = type.substr(type.rfind(':') + 1);
  Tokens tokens(idl);
  for (std::string_view token = tokens.Next(); !token.empty(); token = tokens.Next()) {
    if (token != "struct" || tokens.Next() != name || tokens.Next() != "{") continue;
    HeaderLayout layout{0};
    std::string member;  // its tokens, a space behind each
    for (token = tokens.Next(); !token.empty() && token != "}"; token = tokens.Next()) {
      if (token != ";") {
        member.append(token) += ' ';
        continue;
      }
      if (member == "unsigned long long seq " || member == "uint64 seq ") {
        return layout.keys > 0 ? std::optional(layout) : std::nullopt;
      }
      if (!member.starts_with("@ key string ")) return std::nullopt;
      ++layout.keys;
      member.clear();
    }
    return std::nullopt;
  }
  return std::nullopt;
}

std::optional<SampleHeader> ReadSampleHeader(std::span<const std::uint8_t> cdr,
                                             HeaderLayout layout) {
  if (cdr.size() < kEncapsulation) return std::nullopt;
  // The second byte is 0 for big-endian and 1 for little-endian plain CDR; others are not ours.
  if (cdr[0] != 0 || cdr[1] > 1) return std::nullopt;
  const bool little_endian = cdr[1] == 1;
  const std::span<const std::uint8_t> body = cdr.subspan(kEncapsulation);
  SampleHeader header;
  std::size_t at = 0;
  for (int key = 0; key < layout.keys; ++key) {
    at = (at + 3) / 4 * 4;
    if (at + 4 > body.size()) return std::nullopt;
    const std::uint64_t length = ReadNumber(body.subspan(at, 4), little_endian);  // with its zero
    at += 4;
    if (length == 0 || length > body.size() - at) return std::nullopt;
    if (key == 0) {
      const auto text = body.subspan(at, static_cast<std::size_t>(length) - 1);
      header.source.assign(text.begin(), text.end());
    }
    at += static_cast<std::size_t>(length);
  }
  at = (at + 7) / 8 * 8;
  if (at + 8 > body.size()) return std::nullopt;
  header.seq = ReadNumber(body.subspan(at, 8), little_endian);
  return header;
}

}  // namespace exemplar::recorder
