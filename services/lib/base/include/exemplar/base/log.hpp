#pragma once
// Events for operators: one line each. A port; program/ writes text or JSON lines.

#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "exemplar/base/text.hpp"

namespace exemplar {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

/// A named value of an event.
struct LogField {
  LogField(std::string_view field_name, std::string_view text) : name(field_name), value(text) {}
  LogField(std::string_view field_name, const std::string& text) : name(field_name), value(text) {}
  LogField(std::string_view field_name, const char* text) : name(field_name), value(text) {}
  LogField(std::string_view field_name, double number)
      : name(field_name), value(FormatDouble(number)) {}
  template <class Integer>
  requires std::is_integral_v<Integer> LogField(std::string_view field_name, Integer number)
      : name(field_name), value(std::to_string(number)) {}

  std::string name;
  std::string value;
};

/// Thread-safe.
class Log {
 public:
  using Fields = std::initializer_list<LogField>;
  virtual ~Log() = default;
  virtual void Write(LogLevel level, std::string_view event, Fields fields) = 0;

  void Debug(std::string_view event, Fields fields = {}) { Write(LogLevel::kDebug, event, fields); }
  void Info(std::string_view event, Fields fields = {}) { Write(LogLevel::kInfo, event, fields); }
  void Warning(std::string_view event, Fields fields = {}) {
    Write(LogLevel::kWarning, event, fields);
  }
  void Error(std::string_view event, Fields fields = {}) { Write(LogLevel::kError, event, fields); }
};

/// Keeps nothing: for tests and for libraries used without a program.
class NullLog final : public Log {
 public:
  void Write(LogLevel, std::string_view, Fields) override {}
};

}  // namespace exemplar
