#pragma once
// Tables, and progress that is drawn on a terminal and told in lines to a pipe.

#include <string>
#include <string_view>
#include <vector>

namespace exemplar::cli {

/// Rows under a header, columns aligned; numbers to the right. The first row sets the width in
/// columns.
class Table {
 public:
  explicit Table(std::vector<std::string> header);
  void Add(std::vector<std::string> row);
  /// Lines with `indent` blanks before each.
  std::string Text(int indent = 0) const;

 private:
  std::vector<std::vector<std::string>> rows_;
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
