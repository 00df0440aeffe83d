#include "record_codec.hpp"

#include <zlib.h>

#include <algorithm>

namespace exemplar::recording {
namespace {

void PutLittleEndian(std::uint64_t value, std::size_t bytes, std::uint8_t* out) {
  for (std::size_t i = 0; i < bytes; ++i) out[i] = static_cast<std::uint8_t>(value >> (8 * i));
}

/// Appends one record; its length is put in at the end.
class Encoder {
 public:
  Encoder(Opcode opcode, Bytes& out) : out_(out) {
    out_.push_back(static_cast<std::uint8_t>(opcode));
    start_ = out_.size();
    out_.resize(out_.size() + 8);
  }
  ~Encoder() { PutLength(8, start_, out_.size() - start_ - 8 + following_); }
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;

  Encoder& U8(std::uint8_t v) { return Number(v, 1); }
  Encoder& U16(std::uint16_t v) { return Number(v, 2); }
  Encoder& U32(std::uint32_t v) { return Number(v, 4); }
  Encoder& U64(std::uint64_t v) { return Number(v, 8); }
  Encoder& Time(Stamp v) { return U64(static_cast<std::uint64_t>(v.nanoseconds())); }
  Encoder& String(const std::string& v) {
    U32(static_cast<std::uint32_t>(v.size()));
    out_.insert(out_.end(), v.begin(), v.end());
    return *this;
  }
  Encoder& Raw(ByteView v) {
    out_.insert(out_.end(), v.begin(), v.end());
    return *this;
  }
  Encoder& Map(const StringMap& map) {
    const std::size_t at = BeginSized();
    for (const auto& [key, value] : map) String(key).String(value);
    return EndSized(at);
  }
  /// A byte length that is put in once what it counts is there.
  std::size_t BeginSized() {
    U32(0);
    return out_.size();
  }
  Encoder& EndSized(std::size_t at) {
    PutLength(4, at - 4, out_.size() - at);
    return *this;
  }
  /// Bytes that somebody else appends to the record.
  Encoder& Following(std::uint64_t count) {
    following_ = count;
    return *this;
  }
  /// What was encoded of the record so far.
  ByteView content() const { return ByteView(out_).subspan(start_ + 8); }

 private:
  Encoder& Number(std::uint64_t v, int bytes) {
    const std::size_t at = out_.size();
    out_.resize(at + static_cast<std::size_t>(bytes));
    PutLittleEndian(v, static_cast<std::size_t>(bytes), out_.data() + at);
    return *this;
  }
  void PutLength(std::size_t bytes, std::size_t at, std::uint64_t v) {
    PutLittleEndian(v, bytes, out_.data() + at);
  }

  Bytes& out_;
  std::size_t start_;
  std::uint64_t following_ = 0;
};

/// Reads fields; after the first that does not fit all further ones are empty and ok() is false.
class Decoder {
 public:
  explicit Decoder(ByteView bytes) : bytes_(bytes) {}

  bool ok() const { return ok_; }
  std::size_t left() const { return bytes_.size() - at_; }
  std::size_t position() const { return at_; }

  std::uint8_t U8() { return static_cast<std::uint8_t>(Number(1)); }
  std::uint16_t U16() { return static_cast<std::uint16_t>(Number(2)); }
  std::uint32_t U32() { return static_cast<std::uint32_t>(Number(4)); }
  std::uint64_t U64() { return Number(8); }
  Stamp Time() { return Stamp::FromNanoseconds(static_cast<std::int64_t>(U64())); }
  ByteView Raw(std::uint64_t size) {
    if (!ok_ || size > left()) {
      ok_ = false;
      return {};
    }
    const ByteView raw = bytes_.subspan(at_, static_cast<std::size_t>(size));
    at_ += raw.size();
    return raw;
  }
  Bytes Blob(std::uint64_t size) {
    const ByteView raw = Raw(size);
    return Bytes(raw.begin(), raw.end());
  }
  std::string String() {
    const ByteView raw = Raw(U32());
    return std::string(raw.begin(), raw.end());
  }
  StringMap Map() {
    Decoder entries(Raw(U32()));
    StringMap map;
    while (entries.ok() && entries.left() > 0) {
      std::string key = entries.String();
      map[std::move(key)] = entries.String();
    }
    ok_ = ok_ && entries.ok();
    return map;
  }
  /// A map of numbers: 16-bit key, 64-bit value.
  std::map<std::uint16_t, std::uint64_t> NumberMap() {
    Decoder entries(Raw(U32()));
    std::map<std::uint16_t, std::uint64_t> map;
    while (entries.ok() && entries.left() > 0) {
      const std::uint16_t key = entries.U16();
      map[key] = entries.U64();
    }
    ok_ = ok_ && entries.ok();
    return map;
  }

 private:
  std::uint64_t Number(std::size_t size) {
    const ByteView raw = Raw(size);
    std::uint64_t v = 0;
    for (std::size_t i = raw.size(); i > 0; --i) v = (v << 8) | raw[i - 1];
    return v;
  }

  ByteView bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

void PutNumberMap(const std::map<std::uint16_t, std::uint64_t>& map, Encoder& encoder) {
  const std::size_t at = encoder.BeginSized();
  for (const auto& [key, value] : map) encoder.U16(key).U64(value);
  encoder.EndSized(at);
}

MessageIndex DecodeMessageIndex(Decoder& d, bool& ok) {
  MessageIndex index;
  index.channel_id = d.U16();
  Decoder entries(d.Raw(d.U32()));
  while (entries.ok() && entries.left() > 0) {
    MessageIndexEntry& entry = index.entries.emplace_back();
    entry.log_time = entries.Time();
    entry.offset = entries.U64();
  }
  ok = entries.ok();
  return index;
}

ChunkIndex DecodeChunkIndex(Decoder& d) {
  ChunkIndex index;
  index.message_start_time = d.Time();
  index.message_end_time = d.Time();
  index.chunk_start_offset = d.U64();
  index.chunk_length = d.U64();
  index.message_index_offsets = d.NumberMap();
  index.message_index_length = d.U64();
  index.compression = d.String();
  index.compressed_size = d.U64();
  index.uncompressed_size = d.U64();
  return index;
}

Chunk DecodeChunkFields(Decoder& d) {
  Chunk chunk;
  chunk.message_start_time = d.Time();
  chunk.message_end_time = d.Time();
  chunk.uncompressed_size = d.U64();
  chunk.uncompressed_crc = d.U32();
  chunk.compression = d.String();
  return chunk;
}

Statistics DecodeStatistics(Decoder& d) {
  Statistics statistics;
  statistics.message_count = d.U64();
  statistics.schema_count = d.U16();
  statistics.channel_count = d.U32();
  statistics.attachment_count = d.U32();
  statistics.metadata_count = d.U32();
  statistics.chunk_count = d.U32();
  statistics.message_start_time = d.Time();
  statistics.message_end_time = d.Time();
  statistics.channel_message_counts = d.NumberMap();
  return statistics;
}

Error Damaged(std::string what) { return {ErrorCode::kDataLoss, std::move(what)}; }

}  // namespace

void Encode(const Header& header, Bytes& out) {
  Encoder(Opcode::kHeader, out).String(header.profile).String(header.library);
}

void Encode(const Footer& footer, Bytes& out) {
  Encoder(Opcode::kFooter, out)
      .U64(footer.summary_start)
      .U64(footer.summary_offset_start)
      .U32(footer.summary_crc);
}

void Encode(const Schema& schema, Bytes& out) {
  Encoder(Opcode::kSchema, out)
      .U16(schema.id)
      .String(schema.name)
      .String(schema.encoding)
      .U32(static_cast<std::uint32_t>(schema.data.size()))
      .Raw(schema.data);
}

void Encode(const Channel& channel, Bytes& out) {
  Encoder(Opcode::kChannel, out)
      .U16(channel.id)
      .U16(channel.schema_id)
      .String(channel.topic)
      .String(channel.message_encoding)
      .Map(channel.metadata);
}

void Encode(const MessageView& message, Bytes& out) {
  // The record that there are most of: in one piece.
  constexpr std::size_t kFields = 2 + 4 + 8 + 8;
  std::uint8_t head[kRecordPrefix + kFields];
  head[0] = static_cast<std::uint8_t>(Opcode::kMessage);
  PutLittleEndian(kFields + message.data.size(), 8, head + 1);
  std::uint8_t* fields = head + kRecordPrefix;
  PutLittleEndian(message.channel_id, 2, fields);
  PutLittleEndian(message.sequence, 4, fields + 2);
  PutLittleEndian(static_cast<std::uint64_t>(message.log_time.nanoseconds()), 8, fields + 6);
  PutLittleEndian(static_cast<std::uint64_t>(message.publish_time.nanoseconds()), 8, fields + 14);
  out.insert(out.end(), std::begin(head), std::end(head));
  out.insert(out.end(), message.data.begin(), message.data.end());
}

void EncodeChunkPrefix(const Chunk& chunk, std::uint64_t compressed_size, Bytes& out) {
  Encoder(Opcode::kChunk, out)
      .Time(chunk.message_start_time)
      .Time(chunk.message_end_time)
      .U64(chunk.uncompressed_size)
      .U32(chunk.uncompressed_crc)
      .String(chunk.compression)
      .U64(compressed_size)
      .Following(compressed_size);
}

void Encode(const MessageIndex& index, Bytes& out) {
  Encoder encoder(Opcode::kMessageIndex, out);
  encoder.U16(index.channel_id);
  const std::size_t at = encoder.BeginSized();
  for (const MessageIndexEntry& entry : index.entries) {
    encoder.Time(entry.log_time).U64(entry.offset);
  }
  encoder.EndSized(at);
}

void Encode(const ChunkIndex& index, Bytes& out) {
  Encoder encoder(Opcode::kChunkIndex, out);
  encoder.Time(index.message_start_time)
      .Time(index.message_end_time)
      .U64(index.chunk_start_offset)
      .U64(index.chunk_length);
  PutNumberMap(index.message_index_offsets, encoder);
  encoder.U64(index.message_index_length)
      .String(index.compression)
      .U64(index.compressed_size)
      .U64(index.uncompressed_size);
}

void Encode(const Attachment& attachment, Bytes& out) {
  Encoder encoder(Opcode::kAttachment, out);
  encoder.Time(attachment.log_time)
      .Time(attachment.create_time)
      .String(attachment.name)
      .String(attachment.media_type)
      .U64(attachment.data.size())
      .Raw(attachment.data);
  encoder.U32(Crc32(0, encoder.content()));
}

void Encode(const AttachmentIndex& index, Bytes& out) {
  Encoder(Opcode::kAttachmentIndex, out)
      .U64(index.offset)
      .U64(index.length)
      .Time(index.log_time)
      .Time(index.create_time)
      .U64(index.data_size)
      .String(index.name)
      .String(index.media_type);
}

void Encode(const Statistics& statistics, Bytes& out) {
  Encoder encoder(Opcode::kStatistics, out);
  encoder.U64(statistics.message_count)
      .U16(statistics.schema_count)
      .U32(statistics.channel_count)
      .U32(statistics.attachment_count)
      .U32(statistics.metadata_count)
      .U32(statistics.chunk_count)
      .Time(statistics.message_start_time)
      .Time(statistics.message_end_time);
  PutNumberMap(statistics.channel_message_counts, encoder);
}

void Encode(const Metadata& metadata, Bytes& out) {
  Encoder(Opcode::kMetadata, out).String(metadata.name).Map(metadata.metadata);
}

void Encode(const MetadataIndex& index, Bytes& out) {
  Encoder(Opcode::kMetadataIndex, out).U64(index.offset).U64(index.length).String(index.name);
}

void Encode(const SummaryOffset& offset, Bytes& out) {
  Encoder(Opcode::kSummaryOffset, out)
      .U8(offset.group_opcode)
      .U64(offset.group_start)
      .U64(offset.group_length);
}

void Encode(const DataEnd& end, Bytes& out) {
  Encoder(Opcode::kDataEnd, out).U32(end.data_section_crc);
}

RecordPrefix DecodePrefix(ByteView bytes) {
  Decoder d(bytes);
  const std::uint8_t opcode = d.U8();
  return {opcode, d.U64()};
}

Result<std::optional<Record>> Decode(std::uint8_t opcode, ByteView content, DecodeOptions options) {
  Decoder d(content);
  std::optional<Record> record;
  bool ok = true;
  switch (static_cast<Opcode>(opcode)) {
    case Opcode::kHeader: {
      Header r;
      r.profile = d.String();
      r.library = d.String();
      record = std::move(r);
      break;
    }
    case Opcode::kFooter: {
      Footer r;
      r.summary_start = d.U64();
      r.summary_offset_start = d.U64();
      r.summary_crc = d.U32();
      record = r;
      break;
    }
    case Opcode::kSchema: {
      Schema r;
      r.id = d.U16();
      r.name = d.String();
      r.encoding = d.String();
      r.data = d.Blob(d.U32());
      record = std::move(r);
      break;
    }
    case Opcode::kChannel: {
      Channel r;
      r.id = d.U16();
      r.schema_id = d.U16();
      r.topic = d.String();
      r.message_encoding = d.String();
      r.metadata = d.Map();
      record = std::move(r);
      break;
    }
    case Opcode::kMessage: {
      Message r;
      r.channel_id = d.U16();
      r.sequence = d.U32();
      r.log_time = d.Time();
      r.publish_time = d.Time();
      r.data = d.Blob(d.left());
      record = std::move(r);
      break;
    }
    case Opcode::kChunk: {
      Chunk r = DecodeChunkFields(d);
      r.records = d.Blob(d.U64());
      record = std::move(r);
      break;
    }
    case Opcode::kMessageIndex:
      record = DecodeMessageIndex(d, ok);
      break;
    case Opcode::kChunkIndex:
      record = DecodeChunkIndex(d);
      break;
    case Opcode::kAttachment: {
      Attachment r;
      r.log_time = d.Time();
      r.create_time = d.Time();
      r.name = d.String();
      r.media_type = d.String();
      r.data = d.Blob(d.U64());
      const std::uint32_t expected =
          d.ok() ? Crc32(0, content.first(d.position())) : std::uint32_t{0};
      const std::uint32_t crc = d.U32();
      if (options.check_attachment_crc && d.ok() && crc != 0 && crc != expected) {
        return Damaged("attachment \"" + r.name + "\": CRC is " + std::to_string(expected) +
                       ", must be " + std::to_string(crc));
      }
      record = std::move(r);
      break;
    }
    case Opcode::kAttachmentIndex: {
      AttachmentIndex r;
      r.offset = d.U64();
      r.length = d.U64();
      r.log_time = d.Time();
      r.create_time = d.Time();
      r.data_size = d.U64();
      r.name = d.String();
      r.media_type = d.String();
      record = std::move(r);
      break;
    }
    case Opcode::kStatistics:
      record = DecodeStatistics(d);
      break;
    case Opcode::kMetadata: {
      Metadata r;
      r.name = d.String();
      r.metadata = d.Map();
      record = std::move(r);
      break;
    }
    case Opcode::kMetadataIndex: {
      MetadataIndex r;
      r.offset = d.U64();
      r.length = d.U64();
      r.name = d.String();
      record = std::move(r);
      break;
    }
    case Opcode::kSummaryOffset: {
      SummaryOffset r;
      r.group_opcode = d.U8();
      r.group_start = d.U64();
      r.group_length = d.U64();
      record = r;
      break;
    }
    case Opcode::kDataEnd: {
      DataEnd r;
      r.data_section_crc = d.U32();
      record = r;
      break;
    }
  }
  if (!d.ok() || !ok) {
    return Damaged("the record (opcode " + std::to_string(opcode) + ", " +
                   std::to_string(content.size()) + " bytes) is shorter than its fields");
  }
  return record;
}

std::optional<MessageFields> DecodeMessageFields(ByteView content) {
  Decoder d(content);
  MessageFields fields;
  fields.channel_id = d.U16();
  fields.sequence = d.U32();
  fields.log_time = d.Time();
  fields.publish_time = d.Time();
  if (!d.ok()) return std::nullopt;
  return fields;
}

Result<Chunk> DecodeCutChunk(ByteView content) {
  Decoder d(content);
  Chunk chunk = DecodeChunkFields(d);
  const std::uint64_t size = d.U64();
  if (!d.ok()) return Damaged("the chunk is cut within its fields");
  chunk.records = d.Blob(std::min<std::uint64_t>(size, d.left()));
  return chunk;
}

std::uint32_t Crc32(std::uint32_t crc, ByteView bytes) {
  if (bytes.empty()) return crc;  // zlib begins anew when the pointer is null
  return static_cast<std::uint32_t>(crc32_z(crc, bytes.data(), bytes.size()));
}

std::uint32_t JoinCrc32(std::uint32_t crc, std::uint32_t of_next, std::uint64_t next_size) {
  return static_cast<std::uint32_t>(crc32_combine(crc, of_next, static_cast<z_off_t>(next_size)));
}

}  // namespace exemplar::recording
