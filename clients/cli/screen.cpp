#include "screen.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>

#include "exemplar/base/text.hpp"

namespace exemplar::cli {
namespace {

/// Characters, not bytes (names may be UTF-8).
std::size_t Width(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
  }));
}

/// Rows and columns of the terminal at stdout; the usual ones where it does not say.
winsize TerminalSize() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || size.ws_col == 0) {
    size.ws_row = 24;
    size.ws_col = 80;
  }
  return size;
}

bool IsNumber(std::string_view text) { return text == "-" || ParseDouble(text).has_value(); }

}  // namespace

bool IsTerminal(int file) {
  const char* kind = std::getenv("TERM");
  return isatty(file) == 1 && (kind == nullptr || std::string_view(kind) != "dumb");
}

std::string Paint(std::string_view text, Colour colour, int file) {
  const char* unwanted = std::getenv("NO_COLOR");
  if ((unwanted != nullptr && *unwanted != '\0') || !IsTerminal(file)) return std::string(text);
  const char* code = "1";
  switch (colour) {
    case Colour::kRed:
      code = "31";
      break;
    case Colour::kYellow:
      code = "33";
      break;
    case Colour::kGreen:
      code = "32";
      break;
    case Colour::kBold:
      code = "1";
      break;
    case Colour::kFaint:
      code = "2";
      break;
  }
  return std::string("\033[") + code + 'm' + std::string(text) + "\033[0m";
}

void LiveText::Show(const std::string& text) {
  const winsize size = TerminalSize();
  std::string drawn = lines_ > 0 ? "\033[" + std::to_string(lines_) + "A\r\033[J" : std::string();
  lines_ = 0;
  for (const std::string_view line : Split(text, '\n')) {
    if (lines_ + 1 >= size.ws_row) break;
    std::size_t bytes = 0;
    int columns = 0;
    bool escape = false;
    while (bytes < line.size() && (columns < size.ws_col || escape)) {
      const char c = line[bytes++];
      if (c == '\033') escape = true;
      if (!escape && (static_cast<unsigned char>(c) & 0xc0) != 0x80) ++columns;
      if (escape && c == 'm') escape = false;
    }
    drawn += std::string(line.substr(0, bytes)) + "\033[K\n";
    ++lines_;
  }
  std::cout << drawn << std::flush;
}

Table::Table(std::vector<std::string> header) { rows_.push_back(std::move(header)); }

void Table::Add(std::vector<std::string> row) {
  row.resize(rows_.front().size());
  rows_.push_back(std::move(row));
}

std::string Table::Text(int indent) const {
  const std::size_t columns = rows_.front().size();
  std::vector<std::size_t> widths(columns, 0);
  std::vector<bool> numeric(columns, rows_.size() > 1);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      widths[c] = std::max(widths[c], Width(rows_[r][c]));
      if (r > 0 && !rows_[r][c].empty() && !IsNumber(rows_[r][c])) numeric[c] = false;
    }
  }
  std::string text;
  for (const std::vector<std::string>& row : rows_) {
    std::string line(static_cast<std::size_t>(indent), ' ');
    for (std::size_t c = 0; c < columns; ++c) {
      const std::string blanks(widths[c] - Width(row[c]), ' ');
      line += numeric[c] ? blanks + row[c] : row[c] + blanks;
      if (c + 1 < columns) line += "  ";
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += (&row == &rows_.front() ? Paint(line, Colour::kBold, STDOUT_FILENO) : line) + '\n';
  }
  return text;
}

ProgressDisplay::ProgressDisplay() : terminal_(IsTerminal(STDERR_FILENO)) {}

ProgressDisplay::~ProgressDisplay() { Clear(); }

void ProgressDisplay::Show(double fraction, std::string_view step, std::string_view detail) {
  if (!terminal_) {
    if (step == last_step_) return;
    last_step_ = step;
    std::cerr << step << (detail.empty() ? "" : ": ") << detail << std::endl;
    return;
  }
  constexpr int kBar = 30;
  const double part = std::clamp(std::isfinite(fraction) ? fraction : 0.0, 0.0, 1.0);
  const int full = static_cast<int>(std::lround(part * kBar));
  std::string percent = std::to_string(static_cast<int>(std::lround(part * 100)));
  percent.insert(0, 3 - std::min<std::size_t>(3, percent.size()), ' ');
  std::cerr << "\r\033[K[" << Paint(std::string(full, '#'), Colour::kGreen, STDERR_FILENO)
            << std::string(kBar - full, '.') << "] " << percent << " % " << step
            << (detail.empty() ? "" : "  ") << detail << std::flush;
  drawn_ = true;
}

void ProgressDisplay::Clear() {
  if (drawn_) std::cerr << "\r\033[K" << std::flush;
  drawn_ = false;
}

}  // namespace exemplar::cli
