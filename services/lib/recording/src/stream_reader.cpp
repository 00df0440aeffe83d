#include "raw_records.hpp"

namespace exemplar::recording {
namespace {

class McapStreamReader final : public StreamReader {
 public:
  McapStreamReader(ByteSource& source, ReaderOptions options)
      : source_(source), options_(options), cursor_(ByteView()) {
    if (options_.check_crcs) crc_ = Crc32(0, kMagic);
  }

  Result<std::optional<Record>> Next() override {
    while (!ended_) {
      Result<std::optional<Record>> record = in_chunk_ ? NextInChunk() : NextInFile();
      if (!record.ok()) ended_ = true;
      if (!record.ok() || record->has_value()) return record;
    }
    return std::optional<Record>();
  }

 private:
  using MaybeRecord = Result<std::optional<Record>>;

  /// nullopt: nothing to give yet.
  MaybeRecord NextInFile() {
    Result<std::optional<RawRecord>> raw =
        ReadRawRecord(source_, offset_, options_.largest_record_bytes);
    if (!raw.ok()) return raw.error();
    if (!raw->has_value() || !(*raw)->whole) {
      return DamagedAt(offset_, "the recording ends without a footer; it was not closed");
    }
    const RawRecord& record = **raw;
    const std::uint64_t begin = offset_;
    offset_ += kRecordPrefix + record.content.size();
    if (record.opcode == static_cast<std::uint8_t>(Opcode::kMessageIndex) &&
        !options_.message_indexes) {
      AddToCrc(record);
      return std::optional<Record>();
    }
    MaybeRecord decoded = Decode(record.opcode, record.content, {options_.check_crcs});
    if (!decoded.ok()) return DamagedAt(begin, decoded.error().message);
    if (const Status crc = CheckCrc(record, *decoded); !crc.ok()) return crc.error();
    AddToCrc(record);
    if (!decoded->has_value()) return decoded;
    if (std::holds_alternative<DataEnd>(**decoded)) {
      summary_begin_ = offset_;
      crc_ = 0;
    } else if (std::holds_alternative<Footer>(**decoded)) {
      ended_ = true;
      if (const Status magic = CheckEndMagic(); !magic.ok()) return magic.error();
    } else if (const Chunk* chunk = std::get_if<Chunk>(&**decoded);
               chunk != nullptr && options_.expanded_chunks) {
      Result<Bytes> records = ChunkRecords(*chunk, options_);
      if (!records.ok()) return DamagedAt(begin, records.error().message);
      chunk_records_ = std::move(*records);
      chunk_offset_ = begin;
      cursor_ = ChunkCursor(chunk_records_);
      in_chunk_ = true;
      return std::optional<Record>();
    }
    return decoded;
  }

  MaybeRecord NextInChunk() {
    const std::optional<ChunkCursor::Item> item = cursor_.Next();
    if (!item) {
      in_chunk_ = false;
      if (cursor_.cut()) return DamagedAt(chunk_offset_, "the chunk ends within a record");
      return std::optional<Record>();
    }
    MaybeRecord decoded = Decode(item->opcode, item->content);
    if (!decoded.ok()) {
      return DamagedAt(chunk_offset_, "byte " + std::to_string(item->offset) +
                                          " of the chunk: " + decoded.error().message);
    }
    return decoded;
  }

  static Bytes PrefixOf(const RawRecord& record) {
    Bytes prefix = {record.opcode};
    for (int i = 0; i < 8; ++i)
      prefix.push_back(static_cast<std::uint8_t>(record.length >> (8 * i)));
    return prefix;
  }

  void AddToCrc(const RawRecord& record) {
    if (!options_.check_crcs) return;
    crc_ = Crc32(Crc32(crc_, PrefixOf(record)), record.content);
  }

  Status CheckCrc(const RawRecord& record, const std::optional<Record>& decoded) const {
    if (!options_.check_crcs || !decoded) return {};
    if (const DataEnd* end = std::get_if<DataEnd>(&*decoded)) {
      if (end->data_section_crc != 0 && end->data_section_crc != crc_) {
        return DamagedAt(record.offset, "the data section's CRC is " + std::to_string(crc_) +
                                            ", must be " + std::to_string(end->data_section_crc));
      }
    } else if (const Footer* footer = std::get_if<Footer>(&*decoded)) {
      if (summary_begin_ == 0) return DamagedAt(record.offset, "no data end before the footer");
      const bool covers_footer_only = footer->summary_start == 0;
      if (!covers_footer_only && footer->summary_start != summary_begin_) {
        return DamagedAt(record.offset, "the footer says that the summary begins at byte " +
                                            std::to_string(footer->summary_start) +
                                            ", the data section ends at byte " +
                                            std::to_string(summary_begin_));
      }
      if (footer->summary_crc == 0) return {};
      std::uint32_t crc = covers_footer_only ? 0 : crc_;
      crc = Crc32(crc, PrefixOf(record));
      crc = Crc32(crc, ByteView(record.content).first(16));
      if (crc != footer->summary_crc) {
        return DamagedAt(record.offset, "the summary's CRC is " + std::to_string(crc) +
                                            ", must be " + std::to_string(footer->summary_crc));
      }
    }
    return {};
  }

  Status CheckEndMagic() {
    std::uint8_t magic[sizeof kMagic] = {};
    const Result<std::size_t> read = source_.Read(offset_, magic);
    if (!read.ok()) return read.error();
    if (*read < sizeof magic || !std::equal(std::begin(magic), std::end(magic), kMagic)) {
      return DamagedAt(offset_, "the footer is not followed by the magic bytes");
    }
    return {};
  }

  ByteSource& source_;
  ReaderOptions options_;
  std::uint64_t offset_ = sizeof kMagic;
  bool ended_ = false;
  std::uint32_t crc_ = 0;  ///< of the section so far
  std::uint64_t summary_begin_ = 0;

  bool in_chunk_ = false;
  std::uint64_t chunk_offset_ = 0;
  Bytes chunk_records_;
  ChunkCursor cursor_;
};

}  // namespace

Result<std::unique_ptr<StreamReader>> StreamReader::Create(ByteSource& source,
                                                           ReaderOptions options) {
  if (const Status magic = CheckMagic(source); !magic.ok()) return magic.error();
  return std::unique_ptr<StreamReader>(std::make_unique<McapStreamReader>(source, options));
}

}  // namespace exemplar::recording
