#pragma once
// The records of the MCAP container format, version 0 (mcap.dev/spec), as values.

#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "exemplar/base/stamp.hpp"
#include "exemplar/recording/bytes.hpp"

namespace exemplar::recording {

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// What a file begins and ends with.
inline constexpr std::uint8_t kMagic[8] = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

using StringMap = std::map<std::string, std::string>;

/// The order of times in the format, which counts nanoseconds without a sign.
constexpr bool Earlier(Stamp a, Stamp b) {
  return static_cast<std::uint64_t>(a.nanoseconds()) < static_cast<std::uint64_t>(b.nanoseconds());
}

struct Header {
  std::string profile;
  std::string library;
  friend bool operator==(const Header&, const Header&) = default;
};

/// Offsets count from the file's start; 0 where there is no such section.
struct Footer {
  std::uint64_t summary_start = 0;
  std::uint64_t summary_offset_start = 0;
  std::uint32_t summary_crc = 0;  ///< 0: not computed
  friend bool operator==(const Footer&, const Footer&) = default;
};

struct Schema {
  std::uint16_t id = 0;  ///< never 0
  std::string name;
  std::string encoding;  ///< "omgidl", ...
  Bytes data;
  friend bool operator==(const Schema&, const Schema&) = default;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  ///< 0: messages without schema
  std::string topic;
  std::string message_encoding;  ///< "cdr", ...
  StringMap metadata;
  friend bool operator==(const Channel&, const Channel&) = default;
};

/// A message whose bytes belong to somebody else.
struct MessageView {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  Stamp log_time;      ///< when it was received
  Stamp publish_time;  ///< when it was sent, on the sender's clock
  ByteView data;
};

struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  Stamp log_time;
  Stamp publish_time;
  Bytes data;

  operator MessageView() const {  // NOLINT: implicit on purpose
    return {channel_id, sequence, log_time, publish_time, data};
  }
  friend bool operator==(const Message&, const Message&) = default;
};

struct Chunk {
  Stamp message_start_time;
  Stamp message_end_time;
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  ///< 0: not computed
  std::string compression;             ///< "", "zstd" or "lz4"
  Bytes records;                       ///< compressed
  friend bool operator==(const Chunk&, const Chunk&) = default;
};

struct MessageIndexEntry {
  Stamp log_time;
  std::uint64_t offset = 0;  ///< of the message's record within the uncompressed chunk
  friend bool operator==(const MessageIndexEntry&, const MessageIndexEntry&) = default;
};

struct MessageIndex {
  std::uint16_t channel_id = 0;
  std::vector<MessageIndexEntry> entries;
  friend bool operator==(const MessageIndex&, const MessageIndex&) = default;
};

struct ChunkIndex {
  Stamp message_start_time;
  Stamp message_end_time;
  std::uint64_t chunk_start_offset = 0;
  std::uint64_t chunk_length = 0;  ///< of the whole record
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;
  std::uint64_t message_index_length = 0;
  std::string compression;
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;
  friend bool operator==(const ChunkIndex&, const ChunkIndex&) = default;
};

struct Attachment {
  Stamp log_time;
  Stamp create_time;
  std::string name;
  std::string media_type;
  Bytes data;
  friend bool operator==(const Attachment&, const Attachment&) = default;
};

struct AttachmentIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  Stamp log_time;
  Stamp create_time;
  std::uint64_t data_size = 0;
  std::string name;
  std::string media_type;
  friend bool operator==(const AttachmentIndex&, const AttachmentIndex&) = default;
};

struct Statistics {
  std::uint64_t message_count = 0;
  std::uint16_t schema_count = 0;
  std::uint32_t channel_count = 0;
  std::uint32_t attachment_count = 0;
  std::uint32_t metadata_count = 0;
  std::uint32_t chunk_count = 0;
  Stamp message_start_time;
  Stamp message_end_time;
  std::map<std::uint16_t, std::uint64_t> channel_message_counts;
  friend bool operator==(const Statistics&, const Statistics&) = default;
};

struct Metadata {
  std::string name;
  StringMap metadata;
  friend bool operator==(const Metadata&, const Metadata&) = default;
};

struct MetadataIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name;
  friend bool operator==(const MetadataIndex&, const MetadataIndex&) = default;
};

struct SummaryOffset {
  std::uint8_t group_opcode = 0;
  std::uint64_t group_start = 0;
  std::uint64_t group_length = 0;
  friend bool operator==(const SummaryOffset&, const SummaryOffset&) = default;
};

struct DataEnd {
  std::uint32_t data_section_crc = 0;  ///< 0: not computed
  friend bool operator==(const DataEnd&, const DataEnd&) = default;
};

using Record = std::variant<Header, Footer, Schema, Channel, Message, Chunk, MessageIndex,
                            ChunkIndex, Attachment, AttachmentIndex, Statistics, Metadata,
                            MetadataIndex, SummaryOffset, DataEnd>;

}  // namespace exemplar::recording
