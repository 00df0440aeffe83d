#pragma once
// Writes MCAP files.

#include <memory>

#include "exemplar/recording/records.hpp"

namespace exemplar::recording {

enum class Compression { kNone, kZstd, kLz4 };

struct WriterOptions {
  std::string profile = {};  ///< convention the file keeps to ("ros2", ...); "" is none
  std::string library = "exemplar";
  /// Schemas, channels and messages go into chunks: indexed reading and compression need them.
  bool chunks = true;
  /// A chunk ends once its records are this long. Larger compresses better, smaller is read sooner.
  std::uint64_t chunk_bytes = 1u << 20;
  Compression compression = Compression::kZstd;
  /// 1 (fast) to 19 (small). 1 compresses pose streams about as well as the default of zstd (3).
  int zstd_level = 1;
  bool chunk_crc = true;    ///< CRC-32 of each chunk's uncompressed records
  bool data_crc = true;     ///< CRC-32 of the whole data section, in DataEnd
  bool summary_crc = true;  ///< CRC-32 of the summary, in the footer
  bool message_indexes = true;
  bool chunk_indexes = true;
  bool attachment_indexes = true;
  bool metadata_indexes = true;
  bool statistics = true;
  bool repeated_schemas = true;   ///< in the summary, so that a reader need not look into chunks
  bool repeated_channels = true;  ///< likewise
  bool summary_offsets = true;
};

/// Thread-compatible. After a failed write every further call fails with the first error: what the
/// sink holds ends at a whole record, and Recover() makes a closed file of it.
class Writer {
 public:
  /// Writes magic and header. The sink must outlive the writer. Chunk indexes wait in `scratch`
  /// until Close (null: in memory), so that a long recording takes no more memory than a short one.
  static Result<std::unique_ptr<Writer>> Create(ByteSink& sink, WriterOptions options = {},
                                                std::unique_ptr<ByteScratch> scratch = nullptr);
  /// Does not close: a file without Close() is an unfinished recording.
  virtual ~Writer() = default;

  /// Refuses id 0 and an id that stands for another schema. The same schema again is no record.
  virtual Status AddSchema(const Schema& schema) = 0;
  /// Refuses an unknown schema id (0 is none) and an id that stands for another channel.
  virtual Status AddChannel(const Channel& channel) = 0;
  virtual Status Write(const MessageView& message) = 0;
  /// An open chunk is ended first: attachments and metadata stand between chunks.
  virtual Status Write(const Attachment& attachment) = 0;
  virtual Status Write(const Metadata& metadata) = 0;

  /// Ends an open chunk and syncs the sink: what was written so far survives a kill.
  virtual Status Flush() = 0;
  /// Writes the summary and syncs; the writer takes nothing afterwards.
  virtual Status Close() = 0;

  virtual std::uint64_t bytes_written() const = 0;  ///< to the sink; an open chunk comes later
  virtual const Statistics& statistics() const = 0;
};

}  // namespace exemplar::recording
