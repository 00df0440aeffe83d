#include "csv_text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "exemplar/base/text.hpp"

namespace exemplar::demonstration {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr double kNotFinite = std::numeric_limits<double>::infinity();

std::string_view WithoutQuotes(std::string_view field) {
  field = Trim(field);
  if (field.size() >= 2 && field.front() == '"' && field.back() == '"') {
    field = Trim(field.substr(1, field.size() - 2));
  }
  return field;
}

/// Separators within quotes do not count.
void SplitFields(std::string_view line, char separator, std::vector<std::string_view>& fields) {
  fields.clear();
  bool quoted = false;
  std::size_t start = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') quoted = !quoted;
    if (line[i] == separator && !quoted) {
      fields.push_back(line.substr(start, i - start));
      start = i + 1;
    }
  }
  fields.push_back(line.substr(start));
}

/// One line a call, without its end.
class Lines {
 public:
  Lines(std::string_view text, std::size_t offset, std::size_t next_line, char line_end)
      : text_(text), offset_(offset), line_(next_line - 1), line_end_(line_end) {}

  bool Next() {
    if (offset_ >= text_.size()) return false;
    const std::size_t end = text_.find(line_end_, offset_);
    ended_ = end != std::string_view::npos;
    content_ = text_.substr(offset_, ended_ ? end - offset_ : std::string_view::npos);
    offset_ = ended_ ? end + 1 : text_.size();
    if (content_.ends_with('\r')) content_.remove_suffix(1);
    ++line_;
    return true;
  }
  std::string_view content() const { return content_; }
  bool ended() const { return ended_; }  ///< false: the text stops before the line's end
  bool last() const { return offset_ >= text_.size(); }
  std::size_t line() const { return line_; }
  std::size_t offset() const { return offset_; }
  bool IsContent() const {
    const std::string_view trimmed = Trim(content_);
    return !trimmed.empty() && trimmed.front() != '#';
  }

 private:
  std::string_view text_;
  std::string_view content_;
  std::size_t offset_;
  std::size_t line_;
  char line_end_;
  bool ended_ = true;
};

enum class CellFault { kNone, kNotANumber, kOutOfRange };

/// `decimal_comma` is set once a number needed it.
CellFault ReadCell(std::string_view cell, bool comma_may_be_decimal, double& value,
                   bool& decimal_comma) {
  if (cell.empty() || cell.front() == ' ' || cell.back() == ' ' || cell.front() == '"' ||
      cell.front() == '\t') {
    cell = WithoutQuotes(cell);
  }
  if (cell.empty()) {
    value = kMissing;
    return CellFault::kNone;
  }
  if (cell.front() == '+') cell.remove_prefix(1);
  const char* const end = cell.data() + cell.size();
  const auto [stop, error] = std::from_chars(cell.data(), end, value);
  if (stop == end && error == std::errc{}) {
    if (!std::isfinite(value)) value = kNotFinite;
    return CellFault::kNone;
  }
  if (stop == end && error == std::errc::result_out_of_range) return CellFault::kOutOfRange;
  if (comma_may_be_decimal && std::count(cell.begin(), cell.end(), ',') == 1) {
    std::string with_point(cell);
    std::replace(with_point.begin(), with_point.end(), ',', '.');
    if (const std::optional<double> number = ParseDouble(with_point)) {
      value = std::isfinite(*number) ? *number : kNotFinite;
      decimal_comma = true;
      return CellFault::kNone;
    }
  }
  return CellFault::kNotANumber;
}

std::string Quoted(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string quoted = "\"";
  for (const char c : text.substr(0, kLongest)) {
    quoted += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  }
  return quoted + (text.size() > kLongest ? "...\"" : "\"");
}

}  // namespace

std::string Place(std::string_view source, std::size_t line) {
  return std::string(source) + ":" + std::to_string(line) + ": ";
}

Result<CsvHeader> ReadCsvHeader(std::string_view text, std::string_view source) {
  CsvHeader header;
  const std::string place(source);
  if (text.find('\0') != std::string_view::npos) {
    return InvalidArgument(place + ": is not a text file (it holds a zero byte at offset " +
                           std::to_string(text.find('\0')) + "); a trial is a UTF-8 CSV file");
  }
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  const std::size_t start = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
  if (text.find('\n') == std::string_view::npos) header.line_end = '\r';

  Lines lines(text, start, 1, header.line_end);
  while (lines.Next() && !lines.IsContent()) {
  }
  if (!lines.IsContent())
    return InvalidArgument(place + ": is empty; a trial starts with a header row");
  header.line = lines.line();
  header.body = lines.offset();

  const auto count = [&](char c) {
    return std::count(lines.content().begin(), lines.content().end(), c);
  };
  for (const char candidate : {';', '\t'}) {
    if (count(candidate) > count(header.separator)) header.separator = candidate;
  }
  std::vector<std::string_view> fields;
  SplitFields(lines.content(), header.separator, fields);
  for (const std::string_view field : fields) header.names.emplace_back(WithoutQuotes(field));
  return header;
}

Result<CsvRows> ReadCsvRows(std::string_view text, std::string_view source, const CsvHeader& header,
                            const std::vector<bool>& wanted) {
  CsvRows rows;
  const std::size_t width = header.names.size();
  rows.columns.resize(width);
  const std::size_t expected_rows = static_cast<std::size_t>(std::count(
      text.begin() + static_cast<std::ptrdiff_t>(header.body), text.end(), header.line_end));
  for (std::size_t c = 0; c < width; ++c) {
    if (wanted[c]) rows.columns[c].reserve(expected_rows + 1);
  }
  rows.lines.reserve(expected_rows + 1);

  const bool comma_may_be_decimal = header.separator != ',';
  bool decimal_comma = false;
  std::vector<std::string_view> fields;
  Lines lines(text, header.body, header.line + 1, header.line_end);
  while (lines.Next()) {
    if (!lines.IsContent()) continue;
    SplitFields(lines.content(), header.separator, fields);
    const bool cut = lines.last() && !lines.ended();
    if (fields.size() != width) {
      if (cut && fields.size() < width) {
        rows.notices.push_back(Place(source, lines.line()) + "the file ends within this row (" +
                               std::to_string(fields.size()) + " of " + std::to_string(width) +
                               " fields): the row was left out");
        break;
      }
      return InvalidArgument(Place(source, lines.line()) + "the row has " +
                             std::to_string(fields.size()) + " fields, the header has " +
                             std::to_string(width));
    }
    for (std::size_t c = 0; c < width; ++c) {
      if (!wanted[c]) continue;
      double value = 0;
      const CellFault fault = ReadCell(fields[c], comma_may_be_decimal, value, decimal_comma);
      if (fault != CellFault::kNone) {
        if (cut && c + 1 == width) {
          for (std::size_t d = 0; d < c; ++d) {
            if (wanted[d]) rows.columns[d].pop_back();
          }
          rows.notices.push_back(Place(source, lines.line()) + header.names[c] +
                                 ": the file ends within " + Quoted(fields[c]) +
                                 ": the row was left out");
          return rows;
        }
        return InvalidArgument(
            Place(source, lines.line()) + header.names[c] + ": " + Quoted(fields[c]) +
                (fault == CellFault::kOutOfRange ? " is out of range" : " is not a number"),
            header.names[c]);
      }
      rows.columns[c].push_back(value);
    }
    rows.lines.push_back(lines.line());
    if (cut) {
      rows.notices.push_back(Place(source, lines.line()) +
                             "the last row has no line end; if the file was cut there, its last "
                             "value may be short");
    }
  }
  if (decimal_comma) {
    rows.notices.push_back(std::string(source) +
                           ": numbers with a decimal comma were read as such");
  }
  return rows;
}

}  // namespace exemplar::demonstration
