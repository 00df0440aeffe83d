#include <algorithm>
#include <tuple>

#include "raw_records.hpp"

namespace exemplar::recording {
namespace {

/// Bytes that a writer of a later version may have put behind DataEnd's fields.
constexpr std::uint64_t kLargestPadding = 64;

std::uint64_t Unsigned(Stamp time) { return static_cast<std::uint64_t>(time.nanoseconds()); }

struct MessagePlace {
  Stamp log_time;
  std::uint64_t offset = 0;  ///< within the chunk
  ByteView content;
};

/// A chunk that is being read, and its messages in order of time.
struct OpenChunk {
  std::uint64_t file_offset = 0;
  Bytes records;
  std::vector<MessagePlace> messages;
  std::size_t next = 0;

  auto Key() const {
    return std::make_tuple(Unsigned(messages[next].log_time), file_offset, messages[next].offset);
  }
};

class McapIndexedReader final : public IndexedReader {
 public:
  McapIndexedReader(ByteSource& source, ReaderOptions options)
      : source_(source), options_(options) {}

  Status Begin() {
    if (const Status magic = CheckMagic(source_); !magic.ok()) return magic;
    Result<Record> header = RecordAt(sizeof kMagic, "header");
    if (!header.ok()) return header.error();
    if (!std::holds_alternative<Header>(*header)) {
      return DamagedAt(sizeof kMagic, "the first record is not a header");
    }
    header_ = std::get<Header>(*header);

    constexpr std::uint64_t kTail = kFooterSize + sizeof kMagic;
    if (source_.size() < kTail) return NotClosed();
    footer_offset_ = source_.size() - kTail;
    std::uint8_t magic[sizeof kMagic] = {};
    const Result<std::size_t> read = source_.Read(source_.size() - sizeof kMagic, magic);
    if (!read.ok()) return read.error();
    if (*read < sizeof magic || !std::equal(std::begin(magic), std::end(magic), kMagic)) {
      return NotClosed();
    }
    Result<Record> footer = RecordAt(footer_offset_, "footer");
    if (!footer.ok()) return footer.error();
    if (!std::holds_alternative<Footer>(*footer)) return NotClosed();
    footer_ = std::get<Footer>(*footer);
    return ReadSummary();
  }

  const Header& header() const override { return header_; }
  const Footer& footer() const override { return footer_; }
  const std::map<std::uint16_t, Schema>& schemas() const override { return schemas_; }
  const std::map<std::uint16_t, Channel>& channels() const override { return channels_; }
  const std::optional<Statistics>& statistics() const override { return statistics_; }
  const std::vector<ChunkIndex>& chunks() const override { return chunks_; }
  const std::vector<AttachmentIndex>& attachments() const override { return attachments_; }
  const std::vector<MetadataIndex>& metadata() const override { return metadata_; }
  const std::vector<Record>& summary() const override { return summary_; }

  Result<Attachment> ReadAttachment(const AttachmentIndex& index) override {
    return ReadAs<Attachment>(index.offset, "attachment");
  }
  Result<Metadata> ReadMetadata(const MetadataIndex& index) override {
    return ReadAs<Metadata>(index.offset, "metadata record");
  }

  Result<DataEnd> ReadDataEnd() override {
    // The data section ends where the summary, or without one the footer, begins. The record's own
    // length is known but for padding, so it is looked for backwards from there.
    const std::uint64_t end = footer_.summary_start != 0 ? footer_.summary_start : footer_offset_;
    for (std::uint64_t padding = 0; padding <= kLargestPadding; ++padding) {
      const std::uint64_t size = kRecordPrefix + 4 + padding;
      if (end < sizeof kMagic + size) break;
      Result<std::optional<RawRecord>> raw =
          ReadRawRecord(source_, end - size, options_.largest_record_bytes);
      if (!raw.ok() || !raw->has_value() || (*raw)->length != 4 + padding ||
          static_cast<Opcode>((*raw)->opcode) != Opcode::kDataEnd) {
        continue;
      }
      Result<std::optional<Record>> record = Decode((*raw)->opcode, (*raw)->content);
      if (!record.ok()) return DamagedAt(end - size, record.error().message);
      return std::get<DataEnd>(**record);
    }
    return DamagedAt(end, "the data section's end is not before the summary");
  }

  Result<std::vector<Record>> ReadChunk(const ChunkIndex& index) override {
    Result<Bytes> bytes = ReadChunkBytes(index);
    if (!bytes.ok()) return bytes.error();
    std::vector<Record> records;
    ChunkCursor cursor(*bytes);
    while (const std::optional<ChunkCursor::Item> item = cursor.Next()) {
      Result<std::optional<Record>> record = Decode(item->opcode, item->content);
      if (!record.ok()) return DamagedAt(index.chunk_start_offset, record.error().message);
      if (record->has_value()) records.push_back(std::move(**record));
    }
    if (cursor.cut()) return DamagedAt(index.chunk_start_offset, "the chunk ends within a record");
    return records;
  }

  Status ReadMessages(const MessageQuery& query,
                      const std::function<bool(const Message&)>& visit) override {
    std::vector<const ChunkIndex*> waiting;
    for (const ChunkIndex& index : chunks_) {
      if (MayMatch(index, query)) waiting.push_back(&index);
    }
    std::sort(waiting.begin(), waiting.end(), [](const ChunkIndex* a, const ChunkIndex* b) {
      return std::pair(Unsigned(a->message_start_time), a->chunk_start_offset) <
             std::pair(Unsigned(b->message_start_time), b->chunk_start_offset);
    });
    const auto later = [](const std::unique_ptr<OpenChunk>& a,
                          const std::unique_ptr<OpenChunk>& b) { return a->Key() > b->Key(); };
    std::vector<std::unique_ptr<OpenChunk>> open;  // a heap, the earliest message in front
    std::size_t opened = 0;
    while (opened < waiting.size() || !open.empty()) {
      if (opened < waiting.size() &&
          (open.empty() ||
           Unsigned(waiting[opened]->message_start_time) <= std::get<0>(open.front()->Key()))) {
        Result<std::unique_ptr<OpenChunk>> chunk = OpenForMessages(*waiting[opened++], query);
        if (!chunk.ok()) return chunk.error();
        if ((*chunk)->messages.empty()) continue;
        open.push_back(std::move(*chunk));
        std::push_heap(open.begin(), open.end(), later);
        continue;
      }
      std::pop_heap(open.begin(), open.end(), later);
      OpenChunk& chunk = *open.back();
      Result<std::optional<Record>> record =
          Decode(static_cast<std::uint8_t>(Opcode::kMessage), chunk.messages[chunk.next++].content);
      if (!record.ok()) return DamagedAt(chunk.file_offset, record.error().message);
      if (!visit(std::get<Message>(**record))) return {};
      if (chunk.next == chunk.messages.size()) {
        open.pop_back();
      } else {
        std::push_heap(open.begin(), open.end(), later);
      }
    }
    return {};
  }

 private:
  static Error NotClosed() {
    return {ErrorCode::kDataLoss,
            "the recording ends without a footer: it was not closed, recover it first"};
  }

  Result<Record> RecordAt(std::uint64_t offset, const std::string& what) {
    Result<std::optional<RawRecord>> raw =
        ReadRawRecord(source_, offset, options_.largest_record_bytes);
    if (!raw.ok()) return raw.error();
    if (!raw->has_value() || !(*raw)->whole)
      return DamagedAt(offset, "no whole " + what + " there");
    Result<std::optional<Record>> record =
        Decode((*raw)->opcode, (*raw)->content, {options_.check_crcs});
    if (!record.ok()) return DamagedAt(offset, record.error().message);
    if (!record->has_value()) return DamagedAt(offset, "no " + what + " there");
    return std::move(**record);
  }

  template <class Kind>
  Result<Kind> ReadAs(std::uint64_t offset, const std::string& what) {
    Result<Record> record = RecordAt(offset, what);
    if (!record.ok()) return record.error();
    if (!std::holds_alternative<Kind>(*record)) return DamagedAt(offset, "no " + what + " there");
    return std::get<Kind>(std::move(*record));
  }

  Status ReadSummary() {
    if (footer_.summary_start == 0) return {};
    if (footer_.summary_start < sizeof kMagic || footer_.summary_start > footer_offset_) {
      return DamagedAt(footer_offset_,
                       "the summary cannot begin at byte " + std::to_string(footer_.summary_start));
    }
    const std::uint64_t length = source_.size() - sizeof kMagic - footer_.summary_start;
    Bytes bytes(static_cast<std::size_t>(length));
    const Result<std::size_t> read = source_.Read(footer_.summary_start, bytes);
    if (!read.ok()) return read.error();
    if (*read < bytes.size()) return DamagedAt(footer_.summary_start, "the summary is cut");
    if (options_.check_crcs && footer_.summary_crc != 0) {
      const std::uint32_t crc = Crc32(0, ByteView(bytes).first(bytes.size() - 4));
      if (crc != footer_.summary_crc) {
        return DamagedAt(footer_.summary_start, "the summary's CRC is " + std::to_string(crc) +
                                                    ", must be " +
                                                    std::to_string(footer_.summary_crc));
      }
    }
    ChunkCursor cursor(ByteView(bytes).first(bytes.size() - kFooterSize));
    while (const std::optional<ChunkCursor::Item> item = cursor.Next()) {
      Result<std::optional<Record>> record = Decode(item->opcode, item->content);
      if (!record.ok()) {
        return DamagedAt(footer_.summary_start + item->offset, record.error().message);
      }
      if (record->has_value()) AddToSummary(std::move(**record));
    }
    if (cursor.cut()) return DamagedAt(footer_.summary_start, "the summary ends within a record");
    return {};
  }

  void AddToSummary(Record record) {
    AddDefinition(record);
    if (const auto* statistics = std::get_if<Statistics>(&record)) statistics_ = *statistics;
    if (const auto* chunk = std::get_if<ChunkIndex>(&record)) chunks_.push_back(*chunk);
    if (const auto* index = std::get_if<AttachmentIndex>(&record)) attachments_.push_back(*index);
    if (const auto* index = std::get_if<MetadataIndex>(&record)) metadata_.push_back(*index);
    summary_.push_back(std::move(record));
  }

  void AddDefinition(const Record& record) {
    if (const auto* schema = std::get_if<Schema>(&record))
      schemas_.try_emplace(schema->id, *schema);
    if (const auto* channel = std::get_if<Channel>(&record)) {
      channels_.try_emplace(channel->id, *channel);
    }
  }

  Result<Bytes> ReadChunkBytes(const ChunkIndex& index) {
    Result<Chunk> chunk = ReadAs<Chunk>(index.chunk_start_offset, "chunk");
    if (!chunk.ok()) return chunk.error();
    Result<Bytes> records = ChunkRecords(*chunk, options_);
    if (!records.ok()) return DamagedAt(index.chunk_start_offset, records.error().message);
    return records;
  }

  bool Wanted(std::uint16_t channel_id, const MessageQuery& query) const {
    if (query.topics.empty()) return true;
    const auto channel = channels_.find(channel_id);
    return channel != channels_.end() && query.topics.contains(channel->second.topic);
  }

  bool MayMatch(const ChunkIndex& index, const MessageQuery& query) const {
    if (query.start && Earlier(index.message_end_time, *query.start)) return false;
    if (query.end && !Earlier(index.message_start_time, *query.end)) return false;
    if (query.topics.empty() || index.message_index_offsets.empty()) return true;
    return std::any_of(index.message_index_offsets.begin(), index.message_index_offsets.end(),
                       [&](const auto& entry) {
                         return !channels_.contains(entry.first) || Wanted(entry.first, query);
                       });
  }

  Result<std::unique_ptr<OpenChunk>> OpenForMessages(const ChunkIndex& index,
                                                     const MessageQuery& query) {
    Result<Bytes> records = ReadChunkBytes(index);
    if (!records.ok()) return records.error();
    auto chunk = std::make_unique<OpenChunk>();
    chunk->file_offset = index.chunk_start_offset;
    chunk->records = std::move(*records);
    ChunkCursor cursor(chunk->records);
    while (const std::optional<ChunkCursor::Item> item = cursor.Next()) {
      const Opcode opcode = static_cast<Opcode>(item->opcode);
      if (opcode != Opcode::kMessage) {
        Result<std::optional<Record>> record = Decode(item->opcode, item->content);
        if (!record.ok()) return DamagedAt(index.chunk_start_offset, record.error().message);
        if (record->has_value()) AddDefinition(**record);
        continue;
      }
      const std::optional<MessageFields> fields = DecodeMessageFields(item->content);
      if (!fields)
        return DamagedAt(index.chunk_start_offset, "a message is shorter than its fields");
      if (query.start && Earlier(fields->log_time, *query.start)) continue;
      if (query.end && !Earlier(fields->log_time, *query.end)) continue;
      if (!Wanted(fields->channel_id, query)) continue;
      chunk->messages.push_back({fields->log_time, item->offset, item->content});
    }
    if (cursor.cut()) return DamagedAt(index.chunk_start_offset, "the chunk ends within a record");
    std::stable_sort(chunk->messages.begin(), chunk->messages.end(),
                     [](const MessagePlace& a, const MessagePlace& b) {
                       return Earlier(a.log_time, b.log_time);
                     });
    return chunk;
  }

  ByteSource& source_;
  ReaderOptions options_;
  Header header_;
  Footer footer_;
  std::uint64_t footer_offset_ = 0;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::optional<Statistics> statistics_;
  std::vector<ChunkIndex> chunks_;
  std::vector<AttachmentIndex> attachments_;
  std::vector<MetadataIndex> metadata_;
  std::vector<Record> summary_;
};

}  // namespace

Result<std::unique_ptr<IndexedReader>> IndexedReader::Open(ByteSource& source,
                                                           ReaderOptions options) {
  auto reader = std::make_unique<McapIndexedReader>(source, options);
  if (const Status begun = reader->Begin(); !begun.ok()) return begun.error();
  return std::unique_ptr<IndexedReader>(std::move(reader));
}

}  // namespace exemplar::recording
