#include "idl_lexer.hpp"

#include <algorithm>

namespace exemplar::dynamic_data {
namespace {

bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsNameStart(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool IsName(char c) { return IsNameStart(c) || IsDigit(c); }

}  // namespace

void Lexer::Advance(std::size_t count) {
  count = std::min(count, text_.size());
  line_ +=
      static_cast<int>(std::count(text_.begin(), text_.begin() + static_cast<long>(count), '\n'));
  text_.remove_prefix(count);
}

std::string_view Lexer::Take(std::size_t count) {
  const std::string_view taken = text_.substr(0, count);
  Advance(count);
  return taken;
}

void Lexer::SkipSpace() {
  while (!text_.empty()) {
    const char c = text_.front();
    if (c == ' ' || c == '\t' || c == '\r' || c == '\n') {
      Advance(1);
    } else if (text_.starts_with("//") || c == '#') {
      Advance(std::min(text_.find('\n'), text_.size()));
    } else if (text_.starts_with("/*")) {
      const std::size_t end = text_.find("*/", 2);
      Advance(end == std::string_view::npos ? text_.size() : end + 2);
    } else {
      return;
    }
  }
}

Token Lexer::Next() {
  SkipSpace();
  Token token{.line = line_};
  if (text_.empty()) return token;
  const char c = text_.front();
  std::size_t length = 1;
  const bool rooted = text_.starts_with("::") && text_.size() > 2 && IsNameStart(text_[2]);
  if (IsNameStart(c) || rooted) {
    token.kind = Token::Kind::kName;
    length = rooted ? 2 : 0;
    for (;;) {
      while (length < text_.size() && IsName(text_[length])) ++length;
      const bool goes_on = text_.substr(length).starts_with("::") && length + 2 < text_.size() &&
                           IsNameStart(text_[length + 2]);
      if (!goes_on) break;
      length += 2;
    }
  } else if (IsDigit(c)) {
    token.kind = Token::Kind::kNumber;
    while (length < text_.size() && (IsName(text_[length]) || text_[length] == '.')) ++length;
  } else if (c == '"' || c == '\'') {
    token.kind = Token::Kind::kText;
    while (length < text_.size() && text_[length] != c) length += text_[length] == '\\' ? 2 : 1;
    length = std::min(length + 1, text_.size());
  } else {
    token.kind = Token::Kind::kSign;
  }
  token.text = Take(length);
  return token;
}

}  // namespace exemplar::dynamic_data
