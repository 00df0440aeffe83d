#include "exemplar/ircp/sample_header.hpp"

namespace exemplar::ircp {
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

namespace {

/// Steps through the beginning of a sample's CDR bytes.
class HeaderReader {
 public:
  explicit HeaderReader(std::span<const std::uint8_t> cdr) {
    // The second byte is 0 for big-endian and 1 for little-endian plain CDR; others are not ours.
    if (cdr.size() < kEncapsulation || cdr[0] != 0 || cdr[1] > 1) return;
    little_endian_ = cdr[1] == 1;
    body_ = cdr.subspan(kEncapsulation);
  }

  std::optional<std::string_view> String() {
    const std::optional<std::uint64_t> length = Number(4);  // with its zero
    if (!length || *length == 0 || *length > body_.size() - at_) return std::nullopt;
    const std::string_view text(reinterpret_cast<const char*>(body_.data() + at_),
                                static_cast<std::size_t>(*length) - 1);
    at_ += static_cast<std::size_t>(*length);
    return text;
  }
  std::optional<std::uint64_t> Number(std::size_t size) {
    at_ = (at_ + size - 1) / size * size;
    if (at_ + size > body_.size()) return std::nullopt;
    const std::uint64_t value = ReadNumber(body_.subspan(at_, size), little_endian_);
    at_ += size;
    return value;
  }

 private:
  std::span<const std::uint8_t> body_;
  bool little_endian_ = true;
  std::size_t at_ = 0;
};

}  // namespace

std::optional<SampleHeader> ReadSampleHeader(std::span<const std::uint8_t> cdr,
                                             HeaderLayout layout) {
  HeaderReader reader(cdr);
  SampleHeader header;
  for (int key = 0; key < layout.keys; ++key) {
    const std::optional<std::string_view> text = reader.String();
    if (!text) return std::nullopt;
    if (key == 0) header.source = *text;
  }
  const std::optional<std::uint64_t> seq = reader.Number(8);
  if (!seq) return std::nullopt;
  header.seq = *seq;
  return header;
}

std::optional<std::vector<std::uint8_t>> ReadSampleKeys(std::span<const std::uint8_t> cdr,
                                                        HeaderLayout layout) {
  HeaderReader reader(cdr);
  std::vector<std::uint8_t> keys;
  for (int key = 0; key < layout.keys; ++key) {
    const std::optional<std::string_view> text = reader.String();
    if (!text) return std::nullopt;
    keys.resize((keys.size() + 3) / 4 * 4);
    const std::size_t length = text->size() + 1;
    for (int shift = 24; shift >= 0; shift -= 8) {
      keys.push_back(static_cast<std::uint8_t>(length >> shift));
    }
    keys.insert(keys.end(), text->begin(), text->end());
    keys.push_back(0);
  }
  return keys;
}

}  // namespace exemplar::ircp
