#pragma once
// Reads MCAP files: in file order (StreamReader), or by their indexes (IndexedReader).

#include <functional>
#include <memory>
#include <optional>
#include <set>

#include "exemplar/recording/records.hpp"

namespace exemplar::recording {

struct ReaderOptions {
  bool expanded_chunks = true;   ///< give a chunk's records instead of the chunk
  bool message_indexes = false;  ///< give MessageIndex records as well
  bool check_crcs = true;        ///< of chunks, attachments, data section and summary
  /// A chunk or record that claims to be longer is damage.
  std::uint64_t largest_record_bytes = 1u << 30;
};

/// Gives the records one after the other. Thread-compatible.
class StreamReader {
 public:
  /// Fails when the magic is missing. The source must outlive the reader.
  static Result<std::unique_ptr<StreamReader>> Create(ByteSource& source,
                                                      ReaderOptions options = {});
  virtual ~StreamReader() = default;
  /// nullopt after the footer. kDataLoss, with the offset, on damage and where the file stops
  /// without a footer; the reader is then at its end. Records of unknown kinds are passed over.
  virtual Result<std::optional<Record>> Next() = 0;
};

/// Which messages; empty and absent mean all.
struct MessageQuery {
  std::set<std::string> topics;
  std::optional<Stamp> start;  ///< log time, included
  std::optional<Stamp> end;    ///< log time, excluded
};

/// Reads the summary at once and the rest when asked. Thread-compatible.
class IndexedReader {
 public:
  /// kDataLoss where the recording was not closed (see Recover). A closed file may still lack a
  /// summary or a part of it: then footer().summary_start is 0, or what is asked for is empty.
  static Result<std::unique_ptr<IndexedReader>> Open(ByteSource& source,
                                                     ReaderOptions options = {});
  virtual ~IndexedReader() = default;

  virtual const Header& header() const = 0;
  virtual const Footer& footer() const = 0;
  /// As the summary repeats them.
  virtual const std::map<std::uint16_t, Schema>& schemas() const = 0;
  virtual const std::map<std::uint16_t, Channel>& channels() const = 0;
  virtual const std::optional<Statistics>& statistics() const = 0;
  virtual const std::vector<ChunkIndex>& chunks() const = 0;
  virtual const std::vector<AttachmentIndex>& attachments() const = 0;
  virtual const std::vector<MetadataIndex>& metadata() const = 0;
  /// All records of the summary section as they stand.
  virtual const std::vector<Record>& summary() const = 0;

  virtual Result<Attachment> ReadAttachment(const AttachmentIndex& index) = 0;
  virtual Result<Metadata> ReadMetadata(const MetadataIndex& index) = 0;
  /// The end of the data section.
  virtual Result<DataEnd> ReadDataEnd() = 0;
  /// The records of one chunk as they stand.
  virtual Result<std::vector<Record>> ReadChunk(const ChunkIndex& index) = 0;
  /// Calls `visit` in order of log time (file order where equal) until it returns false. Holds no
  /// more chunks in memory than overlap in time. Schemas and channels of chunks that were read are
  /// added to schemas() and channels().
  virtual Status ReadMessages(const MessageQuery& query,
                              const std::function<bool(const Message&)>& visit) = 0;
};

}  // namespace exemplar::recording
