#pragma once
// Records to bytes and back. Little endian; strings and maps behind 32-bit lengths (mcap.dev/spec).

#include <optional>

#include "exemplar/recording/records.hpp"

namespace exemplar::recording {

/// Opcode and 64-bit length stand before each record's content.
inline constexpr std::size_t kRecordPrefix = 9;
/// A footer with its prefix; a file ends with one and the magic.
inline constexpr std::size_t kFooterSize = kRecordPrefix + 20;
/// A chunk's content before its records, without the compression's name.
inline constexpr std::size_t kChunkPrefix = 8 + 8 + 8 + 4 + 4 + 8;

/// Each appends a whole record to `out`.
void Encode(const Header& header, Bytes& out);
void Encode(const Footer& footer, Bytes& out);
void Encode(const Schema& schema, Bytes& out);
void Encode(const Channel& channel, Bytes& out);
void Encode(const MessageView& message, Bytes& out);
/// Everything of a chunk's record but the compressed records, which must follow.
void EncodeChunkPrefix(const Chunk& chunk, std::uint64_t compressed_size, Bytes& out);
void Encode(const MessageIndex& index, Bytes& out);
void Encode(const ChunkIndex& index, Bytes& out);
void Encode(const Attachment& attachment, Bytes& out);
void Encode(const AttachmentIndex& index, Bytes& out);
void Encode(const Statistics& statistics, Bytes& out);
void Encode(const Metadata& metadata, Bytes& out);
void Encode(const MetadataIndex& index, Bytes& out);
void Encode(const SummaryOffset& offset, Bytes& out);
void Encode(const DataEnd& end, Bytes& out);

struct RecordPrefix {
  std::uint8_t opcode = 0;
  std::uint64_t length = 0;
};
/// Precondition: at least kRecordPrefix bytes.
RecordPrefix DecodePrefix(ByteView bytes);

struct DecodeOptions {
  bool check_attachment_crc = true;
};
/// A record's content (without prefix). nullopt: a kind that this version does not know. Bytes
/// behind the known fields are passed over, as the format asks. The error says what is wrong, not
/// where.
Result<std::optional<Record>> Decode(std::uint8_t opcode, ByteView content,
                                     DecodeOptions options = {});

/// What a message's record begins with; nullopt when it is too short.
struct MessageFields {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  Stamp log_time;
  Stamp publish_time;
};
std::optional<MessageFields> DecodeMessageFields(ByteView content);

/// A chunk of which only the beginning is there: fields, and as many of its records as there are.
/// kDataLoss when not even the fields are whole.
Result<Chunk> DecodeCutChunk(ByteView content);

/// CRC-32 (IEEE 802.3) of `bytes` behind what `crc` covers already; begin with 0.
std::uint32_t Crc32(std::uint32_t crc, ByteView bytes);
/// The CRC of what `crc` covers and then of `next_size` bytes whose own CRC is `of_next`.
std::uint32_t JoinCrc32(std::uint32_t crc, std::uint32_t of_next, std::uint64_t next_size);

}  // namespace exemplar::recording
