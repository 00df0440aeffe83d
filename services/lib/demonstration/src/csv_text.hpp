#pragma once
// The text of a CSV file: lines, fields and numbers. What the columns mean is csv_layout's
// business.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::demonstration {

/// The first line that is neither blank nor a comment (#).
struct CsvHeader {
  std::vector<std::string> names;  ///< trimmed, without quotes
  char separator = ',';            ///< also ';' and tab
  char line_end = '\n';            ///< '\r' where the file has no '\n'
  std::size_t line = 1;            ///< of the header, counted from 1
  std::size_t body = 0;            ///< offset of the next line
};

/// Fails on an empty file and on what is not text.
Result<CsvHeader> ReadCsvHeader(std::string_view text, std::string_view source);

/// The numbers of a file. A missing value (an empty cell) is NaN, a cell that is not finite ("nan",
/// "inf") is an infinity: all others are finite.
struct CsvRows {
  std::vector<std::vector<double>> columns;  ///< one a name; empty where it was not wanted
  std::vector<std::size_t> lines;            ///< line of each row
  std::vector<std::string> notices;
};

/// Reads the wanted columns (one flag a name). A cut last line is left out with a notice; any other
/// line with a wrong number of fields, and a cell that is no number, is an Error.
Result<CsvRows> ReadCsvRows(std::string_view text, std::string_view source, const CsvHeader& header,
                            const std::vector<bool>& wanted);

/// `FILE:LINE: `, as all errors and notices begin.
std::string Place(std::string_view source, std::size_t line);

}  // namespace exemplar::demonstration
