#include "exemplar/recording/writer.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <span>

#include "compression.hpp"
#include "record_codec.hpp"

namespace exemplar::recording {
namespace {

/// Chunk indexes are moved to and from the scratch by so many bytes.
constexpr std::size_t kBlock = 64 * 1024;

/// Strings, maps and schema texts stand behind 32-bit lengths.
constexpr std::uint64_t kLongestField = std::numeric_limits<std::uint32_t>::max();

std::uint64_t SizeOf(const StringMap& map) {
  std::uint64_t size = 0;
  for (const auto& [key, value] : map) size += 8 + key.size() + value.size();
  return size;
}

Status CheckLength(std::uint64_t size, const std::string& field) {
  if (size <= kLongestField) return {};
  return InvalidArgument(field + ": " + std::to_string(size) + " bytes do not fit the format",
                         field);
}

class McapWriter final : public Writer {
 public:
  McapWriter(ByteSink& sink, WriterOptions options, std::unique_ptr<ByteScratch> scratch)
      : sink_(sink), options_(std::move(options)), index_scratch_(std::move(scratch)) {}

  Status Begin() {
    scratch_.assign(std::begin(kMagic), std::end(kMagic));
    Encode(Header{options_.profile, options_.library}, scratch_);
    return Put(scratch_);
  }

  Status AddSchema(const Schema& schema) override {
    if (const Status ready = CheckReady(); !ready.ok()) return ready;
    if (schema.id == 0) {
      return InvalidArgument("schema \"" + schema.name + "\": id 0 means no schema", "schema.id");
    }
    if (const Status size = CheckLength(schema.data.size(), "schema.data"); !size.ok()) return size;
    const auto [known, inserted] = schemas_.try_emplace(schema.id, schema);
    if (!inserted) {
      if (known->second == schema) return {};
      return InvalidArgument("schema \"" + schema.name + "\": id " + std::to_string(schema.id) +
                                 " is the schema \"" + known->second.name + "\" already",
                             "schema.id");
    }
    ++statistics_.schema_count;
    return PutInData([&](Bytes& out) { Encode(schema, out); });
  }

  Status AddChannel(const Channel& channel) override {
    if (const Status ready = CheckReady(); !ready.ok()) return ready;
    if (channel.schema_id != 0 && !schemas_.contains(channel.schema_id)) {
      return InvalidArgument("channel \"" + channel.topic + "\": schema " +
                                 std::to_string(channel.schema_id) + " was not added",
                             "channel.schema_id");
    }
    if (const Status size = CheckLength(SizeOf(channel.metadata), "channel.metadata"); !size.ok()) {
      return size;
    }
    const auto [known, inserted] = channels_.try_emplace(channel.id, channel);
    if (!inserted) {
      if (known->second == channel) return {};
      return InvalidArgument("channel \"" + channel.topic + "\": id " + std::to_string(channel.id) +
                                 " is the channel of \"" + known->second.topic + "\" already",
                             "channel.id");
    }
    ++statistics_.channel_count;
    if (by_channel_.size() <= channel.id) by_channel_.resize(std::size_t{channel.id} + 1);
    by_channel_[channel.id].known = true;
    return PutInData([&](Bytes& out) { Encode(channel, out); });
  }

  Status Write(const MessageView& message) override {
    if (const Status ready = CheckReady(); !ready.ok()) return ready;
    if (message.channel_id >= by_channel_.size() || !by_channel_[message.channel_id].known) {
      return InvalidArgument(
          "message: channel " + std::to_string(message.channel_id) + " was not added",
          "message.channel_id");
    }
    OfChannel& of_channel = by_channel_[message.channel_id];
    CountMessage(message, of_channel);
    if (!options_.chunks) return PutInData([&](Bytes& out) { Encode(message, out); });
    const std::uint64_t offset = chunk_records_.size();
    Encode(message, chunk_records_);
    if (options_.message_indexes) {
      if (of_channel.index == nullptr) {
        of_channel.index = &chunk_message_indexes_[message.channel_id];
      }
      of_channel.index->entries.push_back({message.log_time, offset});
    }
    const auto [first, last] =
        chunk_message_count_ == 0
            ? std::pair(message.log_time, message.log_time)
            : std::minmax({chunk_start_, chunk_end_, message.log_time}, Earlier);
    chunk_start_ = first;
    chunk_end_ = last;
    ++chunk_message_count_;
    return chunk_records_.size() >= options_.chunk_bytes ? EndChunk() : Status();
  }

  Status Write(const Attachment& attachment) override {
    if (const Status ready = CheckReady(); !ready.ok()) return ready;
    if (const Status ended = EndChunk(); !ended.ok()) return ended;
    scratch_.clear();
    Encode(attachment, scratch_);
    if (options_.attachment_indexes) {
      attachment_indexes_.push_back({bytes_written_, scratch_.size(), attachment.log_time,
                                     attachment.create_time, attachment.data.size(),
                                     attachment.name, attachment.media_type});
    }
    ++statistics_.attachment_count;
    return Put(scratch_);
  }

  Status Write(const Metadata& metadata) override {
    if (const Status ready = CheckReady(); !ready.ok()) return ready;
    if (const Status size = CheckLength(SizeOf(metadata.metadata), "metadata"); !size.ok()) {
      return size;
    }
    if (const Status ended = EndChunk(); !ended.ok()) return ended;
    scratch_.clear();
    Encode(metadata, scratch_);
    if (options_.metadata_indexes) {
      metadata_indexes_.push_back({bytes_written_, scratch_.size(), metadata.name});
    }
    ++statistics_.metadata_count;
    return Put(scratch_);
  }

  Status Flush() override {
    if (const Status ready = CheckReady(); !ready.ok()) return ready;
    if (const Status ended = EndChunk(); !ended.ok()) return ended;
    return Sync();
  }

  Status Close() override {
    if (const Status ready = CheckReady(); !ready.ok()) return ready;
    if (const Status ended = EndChunk(); !ended.ok()) return ended;
    scratch_.clear();
    Encode(DataEnd{options_.data_crc ? data_crc_ : 0}, scratch_);
    if (const Status put = Put(scratch_); !put.ok()) return put;
    if (const Status put = PutSummary(); !put.ok()) return put;
    closed_ = true;
    return Sync();
  }

  std::uint64_t bytes_written() const override { return bytes_written_; }
  const Statistics& statistics() const override { return statistics_; }

 private:
  Status CheckReady() const {
    if (failed_) return *failed_;
    if (closed_) return FailedPrecondition("the recording is closed");
    return {};
  }

  /// A part of what is written whose CRC is known already.
  struct KnownPart {
    std::size_t offset = 0;
    std::size_t size = 0;
    std::uint32_t crc = 0;
  };

  Status Put(ByteView bytes) { return Put(bytes, KnownPart()); }

  Status Put(ByteView bytes, const KnownPart& known) {
    Status written = sink_.Write(bytes);
    if (!written.ok()) {
      failed_ = written.error();
      return written;
    }
    if (options_.data_crc && !data_ended_) {
      data_crc_ = Crc32(data_crc_, bytes.first(known.offset));
      data_crc_ = JoinCrc32(data_crc_, known.crc, known.size);
      data_crc_ = Crc32(data_crc_, bytes.subspan(known.offset + known.size));
    }
    bytes_written_ += bytes.size();
    return {};
  }

  Status Sync() {
    Status synced = sink_.Sync();
    if (!synced.ok()) failed_ = synced.error();
    return synced;
  }

  /// A record of the data section: into the open chunk, or straight out.
  template <class EncodeRecord>
  Status PutInData(const EncodeRecord& encode) {
    if (options_.chunks) {
      encode(chunk_records_);
      return {};
    }
    scratch_.clear();
    encode(scratch_);
    return Put(scratch_);
  }

  /// What is looked up for each message. The pointers lead into maps that never lose an entry.
  struct OfChannel {
    bool known = false;
    std::uint64_t* count = nullptr;
    MessageIndex* index = nullptr;
  };

  void CountMessage(const MessageView& message, OfChannel& of_channel) {
    const bool first = statistics_.message_count++ == 0;
    statistics_.message_start_time =
        first ? message.log_time
              : std::min(statistics_.message_start_time, message.log_time, Earlier);
    statistics_.message_end_time =
        first ? message.log_time
              : std::max(statistics_.message_end_time, message.log_time, Earlier);
    if (of_channel.count == nullptr) {
      of_channel.count = &statistics_.channel_message_counts[message.channel_id];
    }
    ++*of_channel.count;
  }

  Status EndChunk() {
    if (chunk_records_.empty()) return {};
    Chunk chunk;
    if (chunk_message_count_ > 0) {
      chunk.message_start_time = chunk_start_;
      chunk.message_end_time = chunk_end_;
    }
    chunk.uncompressed_size = chunk_records_.size();
    if (options_.chunk_crc) chunk.uncompressed_crc = Crc32(0, chunk_records_);
    chunk.compression = NameOf(options_.compression);
    ByteView records = chunk_records_;
    if (options_.compression != Compression::kNone) {
      const Status compressed =
          Compress(options_.compression, options_.zstd_level, chunk_records_, compressed_);
      if (!compressed.ok()) {
        failed_ = compressed.error();
        return compressed;
      }
      records = compressed_;
    }
    // One write for the whole, so that a failing one leaves no part of a chunk.
    scratch_.clear();
    scratch_.reserve(kRecordPrefix + kChunkPrefix + 8 + records.size());
    EncodeChunkPrefix(chunk, records.size(), scratch_);
    KnownPart known;
    if (options_.compression == Compression::kNone && options_.chunk_crc) {
      known = {scratch_.size(), records.size(), chunk.uncompressed_crc};
    }
    scratch_.insert(scratch_.end(), records.begin(), records.end());
    ChunkIndex index;
    index.message_start_time = chunk.message_start_time;
    index.message_end_time = chunk.message_end_time;
    index.chunk_start_offset = bytes_written_;
    index.chunk_length = scratch_.size();
    index.compression = chunk.compression;
    index.compressed_size = records.size();
    index.uncompressed_size = chunk.uncompressed_size;
    for (auto& [channel_id, message_index] : chunk_message_indexes_) {
      if (message_index.entries.empty()) continue;
      message_index.channel_id = channel_id;
      index.message_index_offsets[channel_id] = bytes_written_ + scratch_.size();
      Encode(message_index, scratch_);
      message_index.entries.clear();
    }
    index.message_index_length = scratch_.size() - index.chunk_length;
    if (const Status put = Put(scratch_, known); !put.ok()) return put;
    if (options_.chunk_indexes) {
      Encode(index, chunk_index_records_);
      if (chunk_index_records_.size() >= kBlock) {
        if (const Status spilled = SpillIndexes(); !spilled.ok()) return spilled;
      }
    }
    ++statistics_.chunk_count;
    chunk_records_.clear();
    chunk_message_count_ = 0;
    return {};
  }

  Status SpillIndexes() {
    Status spilled = index_scratch_->Write(chunk_index_records_);
    if (!spilled.ok()) failed_ = spilled.error();
    chunk_index_records_.clear();
    return spilled;
  }

  Status PutSummary() {
    data_ended_ = true;
    const std::uint64_t start = bytes_written_;
    std::vector<SummaryOffset> groups;
    std::uint32_t crc = 0;
    const auto put = [&](ByteView bytes) {
      if (options_.summary_crc) crc = Crc32(crc, bytes);
      return Put(bytes);
    };
    /// `write` puts the records of one kind.
    const auto group = [&](Opcode opcode, const auto& write) -> Status {
      const std::uint64_t before = bytes_written_;
      if (const Status written = write(); !written.ok()) return written;
      if (bytes_written_ > before) {
        groups.push_back({static_cast<std::uint8_t>(opcode), before, bytes_written_ - before});
      }
      return {};
    };
    const auto all = [&](bool wanted, const auto& records, const auto& record_of) {
      scratch_.clear();
      if (wanted) {
        for (const auto& record : records) Encode(record_of(record), scratch_);
      }
      return put(scratch_);
    };
    const auto second = [](const auto& entry) -> const auto& { return entry.second; };
    const auto itself = [](const auto& record) -> const auto& { return record; };
    const std::pair<Opcode, std::function<Status()>> sections[] = {
        {Opcode::kSchema, [&] { return all(options_.repeated_schemas, schemas_, second); }},
        {Opcode::kChannel, [&] { return all(options_.repeated_channels, channels_, second); }},
        {Opcode::kStatistics,
         [&] { return all(options_.statistics, std::span(&statistics_, 1), itself); }},
        {Opcode::kMetadataIndex, [&] { return all(true, metadata_indexes_, itself); }},
        {Opcode::kAttachmentIndex, [&] { return all(true, attachment_indexes_, itself); }},
        {Opcode::kChunkIndex, [&] { return PutChunkIndexes(put); }}};
    for (const auto& [opcode, write] : sections) {
      if (const Status written = group(opcode, write); !written.ok()) return written;
    }
    Footer footer;
    if (!groups.empty()) footer.summary_start = start;
    if (options_.summary_offsets && !groups.empty()) {
      footer.summary_offset_start = bytes_written_;
      if (const Status written = all(true, groups, itself); !written.ok()) return written;
    }
    // The CRC covers the footer up to the CRC itself.
    scratch_.clear();
    Encode(footer, scratch_);
    if (options_.summary_crc) {
      footer.summary_crc = Crc32(crc, ByteView(scratch_).first(scratch_.size() - 4));
      scratch_.clear();
      Encode(footer, scratch_);
    }
    scratch_.insert(scratch_.end(), std::begin(kMagic), std::end(kMagic));
    return Put(scratch_);
  }

  Status PutChunkIndexes(const std::function<Status(ByteView)>& put) {
    Bytes block(static_cast<std::size_t>(std::min<std::uint64_t>(kBlock, index_scratch_->size())));
    for (std::uint64_t offset = 0; offset < index_scratch_->size(); offset += block.size()) {
      Result<std::size_t> read = index_scratch_->Read(offset, block);
      if (!read.ok()) {
        failed_ = read.error();
        return read.error();
      }
      if (const Status written = put(ByteView(block).first(*read)); !written.ok()) return written;
    }
    return put(chunk_index_records_);
  }

  ByteSink& sink_;
  WriterOptions options_;
  std::optional<Error> failed_;
  bool closed_ = false;
  bool data_ended_ = false;
  std::uint64_t bytes_written_ = 0;
  std::uint32_t data_crc_ = 0;
  Statistics statistics_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::vector<OfChannel> by_channel_;  ///< by id
  Bytes chunk_index_records_;          ///< behind those in the scratch
  std::unique_ptr<ByteScratch> index_scratch_;
  std::vector<AttachmentIndex> attachment_indexes_;
  std::vector<MetadataIndex> metadata_indexes_;

  Bytes chunk_records_;
  std::map<std::uint16_t, MessageIndex> chunk_message_indexes_;
  std::uint64_t chunk_message_count_ = 0;
  Stamp chunk_start_;
  Stamp chunk_end_;
  Bytes compressed_;
  Bytes scratch_;
};

}  // namespace

Result<std::unique_ptr<Writer>> Writer::Create(ByteSink& sink, WriterOptions options,
                                               std::unique_ptr<ByteScratch> scratch) {
  if (options.chunk_bytes == 0) {
    return InvalidArgument("chunk_bytes is 0, must be positive", "chunk_bytes");
  }
  if (options.zstd_level < 1 || options.zstd_level > 19) {
    return InvalidArgument(
        "zstd_level is " + std::to_string(options.zstd_level) + ", must lie between 1 and 19",
        "zstd_level");
  }
  if (scratch == nullptr) scratch = std::make_unique<MemoryScratch>();
  auto writer = std::make_unique<McapWriter>(sink, std::move(options), std::move(scratch));
  if (const Status begun = writer->Begin(); !begun.ok()) return begun.error();
  return std::unique_ptr<Writer>(std::move(writer));
}

}  // namespace exemplar::recording
