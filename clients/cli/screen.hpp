#pragma once
// Tables, and progress that is drawn on a terminal and told in lines to a pipe.

#include <string>
#include <string_view>
#include <vector>

namespace exemplar::cli {

/// Whether `file` (STDOUT_FILENO, STDERR_FILENO) is a terminal that can move its cursor.
bool IsTerminal(int file);

enum class Colour { kRed, kYellow, kGreen, kBold, kFaint };
/// `text` in colour where `file` is a terminal and NO_COLOR is not set (no-color.org).
std::string Paint(std::string_view text, Colour colour, int file);

/// Rows under a header, columns aligned; numbers to the right. The first row sets the width in
/// columns.
class Table {
 public:
  explicit Table(std::vector<std::string> header);
  void Add(std::vector<std::string> row);
  /// Lines with `indent` blanks before each, meant for stdout.
  std::string Text(int indent = 0) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// Text that is drawn over what was drawn before, on a terminal. Goes to stdout.
class LiveText {
 public:
  /// Lines that end in '\n'; what does not fit the terminal's height is left out.
  void Show(const std::string& text);

 private:
  int lines_ = 0;
};

/// Goes to stderr. Thread-compatible.
class ProgressDisplay {
 public:
  ProgressDisplay();
  ~ProgressDisplay();
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;
  /// `step` is what is being done now. A pipe gets a line when the step changes.
  void Show(double fraction, std::string_view step, std::string_view detail = {});
  /// Takes the bar away.
  void Clear();

 private:
  const bool terminal_;
  bool drawn_ = false;
  std::string last_step_;
};

}  // namespace exemplar::cli
