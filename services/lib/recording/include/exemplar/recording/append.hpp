#pragma once
// Adds metadata to a closed file: its messages stay where they are, only what stands behind the
// data section is written anew.

#include <filesystem>

#include "exemplar/recording/bytes.hpp"
#include "exemplar/recording/records.hpp"

namespace exemplar::recording {

/// What stands from `offset` to the file's end.
struct FileTail {
  std::uint64_t offset = 0;
  Bytes bytes;
};

/// The tail of a closed file once `metadata` is its last record. Indexes, statistics and CRCs are
/// carried on as far as the file has them. kDataLoss where the file was not closed.
Result<FileTail> TailWithMetadata(ByteSource& closed, const Metadata& metadata);

/// Puts the metadata into the file. A kill at any moment leaves the old file or the new one, after
/// FinishAppend at the latest: the tail is durable in a journal beside the file (NAME.tail) before
/// the file is touched. Not for two writers at once: the second one gets kFailedPrecondition.
Status AppendMetadata(const std::filesystem::path& path, const Metadata& metadata);

/// Completes what a killed AppendMetadata left behind; whoever opens a file to change it or to
/// judge it calls this first. Without a journal it does nothing.
Status FinishAppend(const std::filesystem::path& path);

}  // namespace exemplar::recording
