#include "raw_records.hpp"

#include <algorithm>

#include "compression.hpp"

namespace exemplar::recording {

Error DamagedAt(std::uint64_t offset, const std::string& what) {
  return {ErrorCode::kDataLoss, "at byte " + std::to_string(offset) + ": " + what};
}

Status CheckMagic(ByteSource& source) {
  std::uint8_t magic[sizeof kMagic] = {};
  const Result<std::size_t> read = source.Read(0, magic);
  if (!read.ok()) return read.error();
  if (*read < sizeof magic || !std::equal(std::begin(magic), std::end(magic), kMagic)) {
    return InvalidArgument(source.size() == 0
                               ? std::string("is empty, not an MCAP recording")
                               : std::string("does not begin as an MCAP recording does"));
  }
  return {};
}

Result<std::optional<RawRecord>> ReadRawRecord(ByteSource& source, std::uint64_t offset,
                                               std::uint64_t largest) {
  std::uint8_t prefix[kRecordPrefix] = {};
  const Result<std::size_t> read = source.Read(offset, prefix);
  if (!read.ok()) return read.error();
  if (*read < sizeof prefix) return std::optional<RawRecord>();
  RawRecord record;
  const RecordPrefix decoded = DecodePrefix(prefix);
  record.opcode = decoded.opcode;
  record.offset = offset;
  record.length = decoded.length;
  if (record.length > largest) {
    return DamagedAt(offset, "a record (opcode " + std::to_string(record.opcode) + ") claims " +
                                 std::to_string(record.length) + " bytes");
  }
  const std::uint64_t begin = offset + kRecordPrefix;
  const std::uint64_t there = source.size() > begin ? source.size() - begin : 0;
  record.content.resize(static_cast<std::size_t>(std::min(record.length, there)));
  const Result<std::size_t> content = source.Read(begin, record.content);
  if (!content.ok()) return content.error();
  record.content.resize(*content);
  record.whole = record.content.size() == record.length;
  return std::optional<RawRecord>(std::move(record));
}

Result<Bytes> ChunkRecords(const Chunk& chunk, const ReaderOptions& options) {
  if (chunk.uncompressed_size > options.largest_record_bytes) {
    return Error{
        ErrorCode::kDataLoss,
        "the chunk claims " + std::to_string(chunk.uncompressed_size) + " uncompressed bytes"};
  }
  Result<Decompressed> records =
      Decompress(chunk.compression, chunk.records, chunk.uncompressed_size);
  if (!records.ok()) return records.error();
  if (!records->whole || records->bytes.size() != chunk.uncompressed_size) {
    return Error{ErrorCode::kDataLoss,
                 "the chunk gives " + std::to_string(records->bytes.size()) + " bytes of " +
                     std::to_string(chunk.uncompressed_size) +
                     (records->fault.empty() ? "" : " (" + records->fault + ")")};
  }
  if (options.check_crcs && chunk.uncompressed_crc != 0) {
    const std::uint32_t crc = Crc32(0, records->bytes);
    if (crc != chunk.uncompressed_crc) {
      return Error{ErrorCode::kDataLoss, "the chunk's CRC is " + std::to_string(crc) +
                                             ", must be " + std::to_string(chunk.uncompressed_crc)};
    }
  }
  return std::move(records->bytes);
}

std::optional<ChunkCursor::Item> ChunkCursor::Next() {
  const ByteView rest = records_.subspan(at_);
  if (rest.empty()) return std::nullopt;
  if (rest.size() < kRecordPrefix) {
    cut_ = true;
    return std::nullopt;
  }
  const RecordPrefix prefix = DecodePrefix(rest);
  if (prefix.length > rest.size() - kRecordPrefix) {
    cut_ = true;
    return std::nullopt;
  }
  Item item{prefix.opcode, at_,
            rest.subspan(kRecordPrefix, static_cast<std::size_t>(prefix.length))};
  at_ += kRecordPrefix + item.content.size();
  return item;
}

}  // namespace exemplar::recording
