#pragma once
// MCAP records as the format's conformance cases write them in JSON.

#include <string>

#include "exemplar/recording/reader.hpp"
#include "exemplar/recording/writer.hpp"

namespace exemplar::conformance {

/// A case's file bytes: its data section's records, written with the features that the case names.
Result<recording::Bytes> WriteCase(const std::string& case_json);

/// {"records": [...]} of a file, read from front to back.
Result<std::string> ReadStreamed(recording::ByteSource& source);

/// The same, through the summary and its indexes; what a file has no index for is read from its
/// data section.
Result<std::string> ReadIndexed(recording::ByteSource& source);

/// The "records" of a case or of a reader's answer in one line each, for comparison.
Result<std::string> NormalisedRecords(const std::string& json);

}  // namespace exemplar::conformance
