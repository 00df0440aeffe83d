#pragma once
// Trials as CSV files: the contract of DESIGN.md "Trials as files".

#include <string>
#include <string_view>

#include "exemplar/base/result.hpp"
#include "exemplar/demonstration/trial.hpp"

namespace exemplar::demonstration {

/// Reads a trial. What can be mended is mended and said in `notices` (time that stalls or repeats,
/// quaternions off unit length or of the other sign, a cut last line, ...); the rest is an Error of
/// the form `FILE:LINE: COLUMN: what is wrong`. `source` is the name errors use.
Result<Trial> ReadCsv(std::string_view text, std::string_view source);

/// Writes every stream onto the time stamps of the densest one. ReadCsv(WriteCsv(t)) holds the same
/// samples as t where all streams share their time stamps.
std::string WriteCsv(const Trial& trial);

}  // namespace exemplar::demonstration
