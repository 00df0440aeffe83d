#include "exemplar/recording/append.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <variant>

#include "exemplar/recording/file.hpp"
#include "exemplar/recording/reader.hpp"
#include "record_codec.hpp"

namespace exemplar::recording {
namespace {

constexpr std::size_t kDataEndSize = kRecordPrefix + 4;
constexpr std::size_t kJournalPrefix = 8 + 8 + 4;  // offset, length, CRC-32 of what follows

std::filesystem::path JournalOf(const std::filesystem::path& path) {
  std::filesystem::path journal = path;
  journal += ".tail";
  return journal;
}

/// The summary's records by kind, in the order in which the kinds stood.
struct Group {
  std::uint8_t opcode = 0;
  Bytes records;
};

class Summary {
 public:
  void Add(Opcode opcode, const auto& record) {
    const auto code = static_cast<std::uint8_t>(opcode);
    auto group = std::find_if(groups_.begin(), groups_.end(),
                              [&](const Group& g) { return g.opcode == code; });
    if (group == groups_.end()) group = groups_.insert(groups_.end(), {code, {}});
    Encode(record, group->records);
  }
  const std::vector<Group>& groups() const { return groups_; }

 private:
  std::vector<Group> groups_;
};

template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <class... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;

/// Footer and magic behind `bytes`, which begin with the summary at `start` of the file.
void EndFile(Footer footer, bool with_crc, std::size_t summary_in_bytes, Bytes& bytes) {
  const std::size_t footer_at = bytes.size();
  Encode(footer, bytes);
  if (with_crc) {
    const ByteView covered = ByteView(bytes).subspan(summary_in_bytes);
    footer.summary_crc = Crc32(0, covered.first(covered.size() - 4));
    bytes.resize(footer_at);
    Encode(footer, bytes);
  }
  bytes.insert(bytes.end(), std::begin(kMagic), std::end(kMagic));
}

void PutNumber(std::uint64_t value, std::size_t size, Bytes& out) {
  for (std::size_t i = 0; i < size; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

std::uint64_t TakeNumber(ByteView bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value |= std::uint64_t{bytes[at + i]} << (8 * i);
  return value;
}

/// An open file that one process at a time may change.
class LockedFile {
 public:
  static Result<std::unique_ptr<LockedFile>> Open(const std::filesystem::path& path) {
    const int descriptor = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
    if (descriptor < 0) {
      const ErrorCode code =
          errno == ENOENT ? ErrorCode::kNotFound : ErrorCode::kFailedPrecondition;
      return Error{code, path.string() + ": cannot be changed: " + std::strerror(errno), "path"};
    }
    std::unique_ptr<LockedFile> file(new LockedFile(descriptor, path));
    if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
      return FailedPrecondition(path.string() + ": is being changed by somebody else", "path");
    }
    return file;
  }
  ~LockedFile() { ::close(descriptor_); }
  LockedFile(const LockedFile&) = delete;
  LockedFile& operator=(const LockedFile&) = delete;

  /// `tail` becomes the file's end; durable when it returns.
  Status Replace(const FileTail& tail) {
    std::size_t written = 0;
    while (written < tail.bytes.size()) {
      const ssize_t count =
          ::pwrite(descriptor_, tail.bytes.data() + written, tail.bytes.size() - written,
                   static_cast<off_t>(tail.offset + written));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return Failed("cannot be written");
      written += static_cast<std::size_t>(count);
    }
    if (::ftruncate(descriptor_, static_cast<off_t>(tail.offset + tail.bytes.size())) != 0) {
      return Failed("cannot be cut");
    }
    if (::fsync(descriptor_) != 0) return Failed("cannot be synced");
    return {};
  }

 private:
  LockedFile(int descriptor, std::filesystem::path path)
      : descriptor_(descriptor), path_(std::move(path)) {}
  Error Failed(const std::string& what) const {
    return {ErrorCode::kInternal, path_.string() + ": " + what + ": " + std::strerror(errno),
            "path"};
  }

  int descriptor_;
  std::filesystem::path path_;
};

/// nullopt where the journal itself was not finished: the file is then as it was.
Result<std::optional<FileTail>> ReadJournal(const std::filesystem::path& journal) {
  const auto source = FileSource::Open(journal);
  if (!source.ok()) return source.error();
  Bytes bytes(static_cast<std::size_t>((*source)->size()));
  const Result<std::size_t> read = (*source)->Read(0, bytes);
  if (!read.ok()) return read.error();
  if (*read != bytes.size() || bytes.size() < kJournalPrefix) return std::optional<FileTail>();
  const std::uint64_t length = TakeNumber(bytes, 8, 8);
  const ByteView content = ByteView(bytes).subspan(kJournalPrefix);
  if (length != content.size() || TakeNumber(bytes, 16, 4) != Crc32(0, content)) {
    return std::optional<FileTail>();
  }
  return std::optional(FileTail{TakeNumber(bytes, 0, 8), Bytes(content.begin(), content.end())});
}

Status WriteJournal(const std::filesystem::path& journal, const FileTail& tail) {
  Bytes bytes;
  PutNumber(tail.offset, 8, bytes);
  PutNumber(tail.bytes.size(), 8, bytes);
  PutNumber(Crc32(0, tail.bytes), 4, bytes);
  bytes.insert(bytes.end(), tail.bytes.begin(), tail.bytes.end());
  const auto sink = FileSink::Create(journal);
  if (!sink.ok()) return sink.error();
  if (const Status written = (*sink)->Write(bytes); !written.ok()) return written;
  return (*sink)->Sync();
}

void RemoveJournal(const std::filesystem::path& journal) {
  std::error_code ignored;  // at worst it is applied once more, to the same effect
  std::filesystem::remove(journal, ignored);
}

/// Precondition: the file's lock is held.
Status ApplyJournal(LockedFile& file, const std::filesystem::path& path) {
  const std::filesystem::path journal = JournalOf(path);
  std::error_code ignored;
  if (!std::filesystem::exists(journal, ignored)) return {};
  const Result<std::optional<FileTail>> tail = ReadJournal(journal);
  if (!tail.ok()) return tail.error();
  if (tail->has_value()) {
    std::error_code error;
    const std::uint64_t size = std::filesystem::file_size(path, error);
    if (error || size < (*tail)->offset) {
      return Error{ErrorCode::kDataLoss, journal.string() + ": does not belong to " + path.string(),
                   "path"};
    }
    if (const Status replaced = file.Replace(**tail); !replaced.ok()) return replaced;
  }
  RemoveJournal(journal);
  return {};
}

}  // namespace

Result<FileTail> TailWithMetadata(ByteSource& closed, const Metadata& metadata) {
  const auto opened = IndexedReader::Open(closed);
  if (!opened.ok()) return opened.error();
  IndexedReader& reader = **opened;
  const Footer& footer = reader.footer();
  const std::uint64_t behind_data = footer.summary_start != 0
                                        ? footer.summary_start
                                        : closed.size() - kFooterSize - std::size(kMagic);
  std::array<std::uint8_t, kDataEndSize> end_bytes{};
  const std::uint64_t offset = behind_data - kDataEndSize;
  const Result<std::size_t> read = closed.Read(offset, end_bytes);
  if (!read.ok()) return read.error();
  if (*read != kDataEndSize || end_bytes[0] != static_cast<std::uint8_t>(Opcode::kDataEnd)) {
    return Error{ErrorCode::kDataLoss, "the data section does not end where the summary begins"};
  }
  FileTail tail;
  tail.offset = offset;
  Encode(metadata, tail.bytes);
  const std::uint64_t metadata_length = tail.bytes.size();
  DataEnd end{static_cast<std::uint32_t>(TakeNumber(end_bytes, kRecordPrefix, 4))};
  if (end.data_section_crc != 0) end.data_section_crc = Crc32(end.data_section_crc, tail.bytes);
  Encode(end, tail.bytes);
  const std::size_t summary_at = tail.bytes.size();

  Footer fresh;
  if (footer.summary_start == 0) {
    EndFile(fresh, footer.summary_crc != 0, summary_at, tail.bytes);
    return tail;
  }
  Summary summary;
  bool had_statistics = false;
  std::uint32_t metadata_before = 0;
  for (const Record& record : reader.summary()) {
    std::visit(
        Overloaded{[&](const Schema& r) { summary.Add(Opcode::kSchema, r); },
                   [&](const Channel& r) { summary.Add(Opcode::kChannel, r); },
                   [&](const Statistics& r) {
                     had_statistics = true;
                     Statistics statistics = r;
                     metadata_before = r.metadata_count;
                     ++statistics.metadata_count;
                     summary.Add(Opcode::kStatistics, statistics);
                   },
                   [&](const ChunkIndex& r) { summary.Add(Opcode::kChunkIndex, r); },
                   [&](const AttachmentIndex& r) { summary.Add(Opcode::kAttachmentIndex, r); },
                   [&](const MetadataIndex& r) { summary.Add(Opcode::kMetadataIndex, r); },
                   [](const auto&) {}},
        record);
  }
  // A file that keeps no index of its metadata gets none of one of them only.
  if (!had_statistics || metadata_before == reader.metadata().size()) {
    summary.Add(Opcode::kMetadataIndex, MetadataIndex{offset, metadata_length, metadata.name});
  }
  fresh.summary_start = offset + summary_at;
  std::vector<SummaryOffset> offsets;
  for (const Group& group : summary.groups()) {
    offsets.push_back({group.opcode, offset + tail.bytes.size(), group.records.size()});
    tail.bytes.insert(tail.bytes.end(), group.records.begin(), group.records.end());
  }
  if (footer.summary_offset_start != 0) {
    fresh.summary_offset_start = offset + tail.bytes.size();
    for (const SummaryOffset& entry : offsets) Encode(entry, tail.bytes);
  }
  EndFile(fresh, footer.summary_crc != 0, summary_at, tail.bytes);
  return tail;
}

Status AppendMetadata(const std::filesystem::path& path, const Metadata& metadata) {
  const auto file = LockedFile::Open(path);
  if (!file.ok()) return file.error();
  if (const Status finished = ApplyJournal(**file, path); !finished.ok()) return finished;
  const auto source = FileSource::Open(path);
  if (!source.ok()) return source.error();
  const Result<FileTail> tail = TailWithMetadata(**source, metadata);
  if (!tail.ok()) return WithPlace(tail.error(), path.string());
  const std::filesystem::path journal = JournalOf(path);
  if (const Status written = WriteJournal(journal, *tail); !written.ok()) {
    RemoveJournal(journal);
    return written;
  }
  if (const Status replaced = (*file)->Replace(*tail); !replaced.ok()) return replaced;
  RemoveJournal(journal);
  return {};
}

Status FinishAppend(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(JournalOf(path), ignored)) return {};
  const auto file = LockedFile::Open(path);
  if (!file.ok()) return file.error();
  return ApplyJournal(**file, path);
}

}  // namespace exemplar::recording
