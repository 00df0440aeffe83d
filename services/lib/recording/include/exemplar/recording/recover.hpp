#pragma once
// Makes a closed file of one whose recorder was killed, or that was cut.

#include "exemplar/recording/reader.hpp"
#include "exemplar/recording/writer.hpp"

namespace exemplar::recording {

struct RecoveryReport {
  bool was_whole = false;  ///< closed and undamaged
  std::uint64_t messages = 0;
  std::uint64_t attachments = 0;
  std::uint64_t metadata = 0;
  std::uint64_t damaged_chunks = 0;  ///< left out: wrong CRC or not to be decompressed
  std::uint64_t bytes_left_out = 0;  ///< behind the last record that could be read
  std::vector<std::string> notices;  ///< what was wrong, with its offset
};

/// Copies every whole record: all of whole chunks, and of a chunk that the end cuts the records
/// that are whole (with compression: as far as its blocks are). Fails only if `damaged` does not
/// begin as an MCAP file does, and where the sink or the source fails. `scratch`: as Writer takes
/// it.
Result<RecoveryReport> Recover(ByteSource& damaged, ByteSink& sink, WriterOptions options = {},
                               std::unique_ptr<ByteScratch> scratch = nullptr);

}  // namespace exemplar::recording
