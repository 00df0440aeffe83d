#pragma once
// Steps from record to record of a source, before anything is decoded. Shared by the readers and by
// Recover.

#include "exemplar/recording/reader.hpp"
#include "record_codec.hpp"

namespace exemplar::recording {

/// kInvalidArgument unless the source begins as every MCAP file does.
Status CheckMagic(ByteSource& source);

struct RawRecord {
  std::uint8_t opcode = 0;
  std::uint64_t offset = 0;  ///< of its prefix
  std::uint64_t length = 0;  ///< of its content, as the prefix says
  Bytes content;             ///< shorter than `length` where the source ends
  bool whole = true;
};

/// Reads the record at `offset`. nullopt when the source ends within the prefix. kDataLoss when the
/// record claims more than `largest` bytes.
Result<std::optional<RawRecord>> ReadRawRecord(ByteSource& source, std::uint64_t offset,
                                               std::uint64_t largest);

/// The records of a chunk: decompressed, its length and CRC checked.
Result<Bytes> ChunkRecords(const Chunk& chunk, const ReaderOptions& options);

/// Steps through the records within a chunk.
class ChunkCursor {
 public:
  explicit ChunkCursor(ByteView records) : records_(records) {}
  struct Item {
    std::uint8_t opcode = 0;
    std::uint64_t offset = 0;  ///< within the chunk
    ByteView content;
  };
  /// nullopt at the end, and where the rest is no whole record (`cut()` is then true).
  std::optional<Item> Next();
  bool cut() const { return cut_; }

 private:
  ByteView records_;
  std::size_t at_ = 0;
  bool cut_ = false;
};

/// kDataLoss with the offset in its message.
Error DamagedAt(std::uint64_t offset, const std::string& what);

}  // namespace exemplar::recording
