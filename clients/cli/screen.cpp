#include "screen.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
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

bool IsNumber(std::string_view text) { return text == "-" || ParseDouble(text).has_value(); }

}  // namespace

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
    text += line + '\n';
  }
  return text;
}

ProgressDisplay::ProgressDisplay() : terminal_(isatty(STDERR_FILENO) == 1) {}

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
  std::cerr << "\r\033[K[" << std::string(full, '#') << std::string(kBar - full, '.') << "] "
            << percent << " % " << step << (detail.empty() ? "" : "  ") << detail << std::flush;
  drawn_ = true;
}

void ProgressDisplay::Clear() {
  if (drawn_) std::cerr << "\r\033[K" << std::flush;
  drawn_ = false;
}

}  // namespace exemplar::cli
