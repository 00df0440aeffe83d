#pragma once
#include <string>
#include <string_view>

#include "exemplar/base/result.hpp"

namespace exemplar::dynamic_data {

/// A name (`a::b` is one), a number, "<<", ">>", or a single other character. Empty: the end.
struct Token {
  enum class Kind { kEnd, kName, kNumber, kText, kSign };
  Kind kind = Kind::kEnd;
  std::string_view text = {};
  int line = 1;
};

/// Splits IDL text; comments and preprocessor lines are passed over. Thread-compatible.
class Lexer {
 public:
  explicit Lexer(std::string_view text) : text_(text) {}
  Token Next();

 private:
  void SkipSpace();
  void Advance(std::size_t count);
  std::string_view Take(std::size_t count);

  std::string_view text_;
  int line_ = 1;
};

}  // namespace exemplar::dynamic_data
