#include "exemplar/recording/recover.hpp"

#include <algorithm>

#include "compression.hpp"
#include "raw_records.hpp"

namespace exemplar::recording {
namespace {

class Recovery {
 public:
  Recovery(ByteSource& source, Writer& writer) : source_(source), writer_(writer) {}

  Result<RecoveryReport> Run() {
    std::uint64_t offset = sizeof kMagic;
    bool footer_seen = false;
    while (!footer_seen) {
      Result<std::optional<RawRecord>> raw =
          ReadRawRecord(source_, offset, reading_.largest_record_bytes);
      if (!raw.ok()) {
        if (raw.error().code != ErrorCode::kDataLoss) return raw.error();
        Notice(raw.error().message + "; nothing behind it can be found");
        break;
      }
      if (!raw->has_value()) {
        Notice("at byte " + std::to_string(offset) + ": the recording ends without a footer");
        break;
      }
      const RawRecord& record = **raw;
      footer_seen = record.opcode == static_cast<std::uint8_t>(Opcode::kFooter) && record.whole;
      if (const Status copied = record.whole ? CopyWhole(record) : CopyCut(record); !copied.ok()) {
        return copied.error();
      }
      if (!record.whole) break;
      offset += kRecordPrefix + record.content.size();
    }
    if (const Status closed = writer_.Close(); !closed.ok()) return closed.error();
    report_.was_whole = footer_seen && report_.notices.empty();
    if (!footer_seen) report_.bytes_left_out += source_.size() - std::min(offset, source_.size());
    report_.messages = writer_.statistics().message_count;
    report_.attachments = writer_.statistics().attachment_count;
    report_.metadata = writer_.statistics().metadata_count;
    return std::move(report_);
  }

 private:
  void Notice(std::string text) { report_.notices.push_back(std::move(text)); }

  /// The sink's failures end the recovery; what the records themselves do wrong is noted.
  Status Settle(std::uint64_t offset, const Status& written) {
    if (written.ok()) return {};
    if (written.error().code != ErrorCode::kInvalidArgument) return written;
    Notice(DamagedAt(offset, written.error().message).message);
    return {};
  }

  Status CopyWhole(const RawRecord& raw) {
    if (static_cast<Opcode>(raw.opcode) == Opcode::kChunk) return CopyChunk(raw);
    return CopyRecord(raw.opcode, raw.offset, raw.content);
  }

  Status CopyRecord(std::uint8_t opcode, std::uint64_t offset, ByteView content) {
    Result<std::optional<Record>> record = Decode(opcode, content);
    if (!record.ok()) {
      Notice(DamagedAt(offset, record.error().message).message + "; left out");
      return {};
    }
    if (!record->has_value()) return {};
    if (const auto* schema = std::get_if<Schema>(&**record)) {
      return Settle(offset, writer_.AddSchema(*schema));
    }
    if (const auto* channel = std::get_if<Channel>(&**record)) {
      return Settle(offset, writer_.AddChannel(*channel));
    }
    if (const auto* message = std::get_if<Message>(&**record)) {
      return Settle(offset, writer_.Write(*message));
    }
    if (const auto* attachment = std::get_if<Attachment>(&**record)) {
      return Settle(offset, writer_.Write(*attachment));
    }
    if (const auto* metadata = std::get_if<Metadata>(&**record)) {
      return Settle(offset, writer_.Write(*metadata));
    }
    return {};
  }

  Status CopyChunk(const RawRecord& raw) {
    Result<std::optional<Record>> chunk = Decode(raw.opcode, raw.content);
    Result<Bytes> records = chunk.ok() ? ChunkRecords(std::get<Chunk>(**chunk), reading_)
                                       : Result<Bytes>(chunk.error());
    if (!records.ok()) {
      ++report_.damaged_chunks;
      report_.bytes_left_out += raw.content.size();
      Notice(DamagedAt(raw.offset, records.error().message).message + "; the chunk was left out");
      return {};
    }
    return CopyChunkRecords(raw.offset, *records);
  }

  Status CopyChunkRecords(std::uint64_t chunk_offset, ByteView records) {
    ChunkCursor cursor(records);
    while (const std::optional<ChunkCursor::Item> item = cursor.Next()) {
      const Status copied = CopyRecord(item->opcode, chunk_offset, item->content);
      if (!copied.ok()) return copied;
    }
    return {};
  }

  /// The last record, of which the end is missing.
  Status CopyCut(const RawRecord& raw) {
    Notice("at byte " + std::to_string(raw.offset) + ": the recording ends within a record (" +
           std::to_string(raw.content.size()) + " of " + std::to_string(raw.length) + " bytes)");
    if (static_cast<Opcode>(raw.opcode) != Opcode::kChunk) return {};
    const Result<Chunk> chunk = DecodeCutChunk(raw.content);
    if (!chunk.ok()) return {};
    const std::uint64_t largest = std::min(chunk->uncompressed_size, reading_.largest_record_bytes);
    const Result<Decompressed> records = Decompress(chunk->compression, chunk->records, largest);
    if (!records.ok()) {
      Notice(DamagedAt(raw.offset, records.error().message).message);
      return {};
    }
    return CopyChunkRecords(raw.offset, records->bytes);
  }

  ByteSource& source_;
  Writer& writer_;
  ReaderOptions reading_;
  RecoveryReport report_;
};

}  // namespace

Result<RecoveryReport> Recover(ByteSource& damaged, ByteSink& sink, WriterOptions options,
                               std::unique_ptr<ByteScratch> scratch) {
  if (const Status magic = CheckMagic(damaged); !magic.ok()) return magic.error();
  const Result<std::optional<RawRecord>> first =
      ReadRawRecord(damaged, sizeof kMagic, ReaderOptions().largest_record_bytes);
  if (first.ok() && first->has_value() && (*first)->whole &&
      static_cast<Opcode>((*first)->opcode) == Opcode::kHeader) {
    const Result<std::optional<Record>> header = Decode((*first)->opcode, (*first)->content);
    if (header.ok()) options.profile = std::get<Header>(**header).profile;
  }
  Result<std::unique_ptr<Writer>> writer =
      Writer::Create(sink, std::move(options), std::move(scratch));
  if (!writer.ok()) return writer.error();
  return Recovery(damaged, **writer).Run();
}

}  // namespace exemplar::recording
