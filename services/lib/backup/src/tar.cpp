#include "exemplar/backup/tar.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <numeric>
#include <utility>

#include "exemplar/base/text.hpp"

namespace exemplar::backup {
namespace {

constexpr std::size_t kBlock = 512;
constexpr std::uint64_t kOctalLimit = std::uint64_t{1} << 33;  // 11 octal digits

/// Where a header's fields stand.
struct Field {
  std::size_t offset;
  std::size_t size;
};
constexpr Field kName{0, 100};
constexpr Field kMode{100, 8};
constexpr Field kUser{108, 8};
constexpr Field kGroup{116, 8};
constexpr Field kSize{124, 12};
constexpr Field kTime{136, 12};
constexpr Field kChecksum{148, 8};
constexpr std::size_t kType = 156;
constexpr Field kMagic{257, 8};
constexpr Field kPrefix{345, 155};

Error FromErrno(int number, const std::filesystem::path& path, const std::string& what) {
  ErrorCode code = ErrorCode::kInternal;
  if (number == ENOSPC || number == EDQUOT || number == EFBIG) code = ErrorCode::kResourceExhausted;
  if (number == ENOENT || number == ENOTDIR) code = ErrorCode::kNotFound;
  if (number == EACCES || number == EPERM || number == EROFS) code = ErrorCode::kFailedPrecondition;
  return {code, path.string() + ": " + what + ": " + std::strerror(number), "file"};
}

void PutText(std::string& header, Field field, std::string_view text) {
  header.replace(field.offset, text.size(), text);
}

void PutOctal(std::string& header, Field field, std::uint64_t number) {
  for (std::size_t i = field.size - 1; i-- > 0;) {
    header[field.offset + i] = static_cast<char>('0' + number % 8);
    number /= 8;
  }
}

std::string_view TextOf(std::string_view header, Field field) {
  const std::string_view text = header.substr(field.offset, field.size);
  return text.substr(0, text.find('\0'));
}

std::optional<std::uint64_t> OctalOf(std::string_view header, Field field) {
  const std::string_view digits = Trim(TextOf(header, field));
  std::uint64_t number = 0;
  for (const char c : digits) {
    if (c < '0' || c > '7') return std::nullopt;
    number = 8 * number + static_cast<std::uint64_t>(c - '0');
  }
  return number;
}

/// Of all bytes, those of the checksum itself taken for blanks.
std::uint64_t ChecksumOf(std::string_view header) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < header.size(); ++i) {
    const bool own = i >= kChecksum.offset && i < kChecksum.offset + kChecksum.size;
    sum += own ? std::uint64_t{' '} : static_cast<unsigned char>(header[i]);
  }
  return sum;
}

std::string MakeHeader(std::string_view name, std::uint64_t bytes, std::int64_t mtime_s,
                       char type) {
  constexpr std::uint64_t kReadable = 0644;
  std::string header(kBlock, '\0');
  PutText(header, kName, name.substr(0, kName.size));
  PutOctal(header, kMode, kReadable);
  PutOctal(header, kUser, 0);
  PutOctal(header, kGroup, 0);
  PutOctal(header, kSize, bytes < kOctalLimit ? bytes : 0);
  PutOctal(header, kTime, static_cast<std::uint64_t>(std::max<std::int64_t>(mtime_s, 0)));
  header[kType] = type;
  PutText(header, kMagic,
          std::string_view("ustar\0"
                           "00",
                           8));
  std::uint64_t sum = ChecksumOf(header);
  header[kChecksum.offset + 7] = ' ';
  for (std::size_t i = 6; i-- > 0; sum /= 8) {
    header[kChecksum.offset + i] = static_cast<char>('0' + sum % 8);
  }
  return header;
}

/// "LENGTH KEY=VALUE\n", its own length in front.
std::string PaxRecord(const std::string& key, const std::string& value) {
  const std::size_t bare = key.size() + value.size() + 3;
  std::size_t length = bare + std::to_string(bare).size();
  if (bare + std::to_string(length).size() != length) length = bare + std::to_string(length).size();
  return std::to_string(length) + " " + key + "=" + value + "\n";
}

std::uint64_t PaddingOf(std::uint64_t bytes) { return (kBlock - bytes % kBlock) % kBlock; }

}  // namespace

TarWriter::TarWriter(std::filesystem::path file, std::filesystem::path part, int descriptor)
    : file_(std::move(file)), part_(std::move(part)), descriptor_(descriptor) {}

TarWriter::~TarWriter() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!finished_) ::unlink(part_.c_str());
}

Result<std::unique_ptr<TarWriter>> TarWriter::Create(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::exists(file, error)) {
    return Error{ErrorCode::kAlreadyExists, file.string() + " is there already", "file"};
  }
  std::filesystem::path part = file;
  part += ".part";
  const int descriptor = ::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (descriptor < 0) return FromErrno(errno, part, "cannot be created");
  return std::unique_ptr<TarWriter>(new TarWriter(file, std::move(part), descriptor));
}

Status TarWriter::Put(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      return FromErrno(count < 0 ? errno : ENOSPC, part_,
                       "cannot be written behind byte " + std::to_string(written_));
    }
    written_ += static_cast<std::uint64_t>(count);
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return {};
}

Status TarWriter::Pad() { return Put(std::string(PaddingOf(written_), '\0')); }

Status TarWriter::Begin(const std::string& name, std::uint64_t bytes, std::int64_t mtime_s) {
  if (left_ > 0) return Internal("an entry of " + file_.string() + " lacks its last bytes");
  if (Status padded = Pad(); !padded) return padded;
  std::string pax;
  if (name.size() > kName.size) pax += PaxRecord("path", name);
  if (bytes >= kOctalLimit) pax += PaxRecord("size", std::to_string(bytes));
  if (!pax.empty()) {
    for (const std::string& part : {MakeHeader("pax", pax.size(), mtime_s, 'x'), pax,
                                    std::string(PaddingOf(pax.size()), '\0')}) {
      if (Status put = Put(part); !put) return put;
    }
  }
  left_ = bytes;
  return Put(MakeHeader(name, bytes, mtime_s, '0'));
}

Status TarWriter::Write(std::string_view bytes) {
  if (bytes.size() > left_) return Internal("an entry of " + file_.string() + " is too long");
  left_ -= bytes.size();
  return Put(bytes);
}

Status TarWriter::Finish() {
  if (left_ > 0) return Internal("an entry of " + file_.string() + " lacks its last bytes");
  if (Status padded = Pad(); !padded) return padded;
  if (Status ended = Put(std::string(2 * kBlock, '\0')); !ended) return ended;
  if (::fsync(descriptor_) != 0) return FromErrno(errno, part_, "cannot be synced");
  const int closed = ::close(std::exchange(descriptor_, -1));
  if (closed != 0) return FromErrno(errno, part_, "cannot be closed");
  if (::rename(part_.c_str(), file_.c_str()) != 0) {
    return FromErrno(errno, file_, "cannot get its name");
  }
  finished_ = true;
  const std::filesystem::path folder = file_.has_parent_path() ? file_.parent_path() : ".";
  const int opened = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (opened >= 0) {
    // Some file systems cannot sync a folder; the file itself is synced all the same.
    static_cast<void>(::fsync(opened));
    ::close(opened);
  }
  return {};
}

TarReader::TarReader(std::filesystem::path file, int descriptor, std::uint64_t size)
    : file_(std::move(file)), descriptor_(descriptor), size_(size) {}

TarReader::~TarReader() { ::close(descriptor_); }

Result<std::unique_ptr<TarReader>> TarReader::Open(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return FromErrno(errno, file, "cannot be opened");
  struct stat facts {};
  if (::fstat(descriptor, &facts) != 0 || !S_ISREG(facts.st_mode)) {
    ::close(descriptor);
    return InvalidArgument(file.string() + " is no file", "file");
  }
  return std::unique_ptr<TarReader>(
      new TarReader(file, descriptor, static_cast<std::uint64_t>(facts.st_size)));
}

Error TarReader::Damaged(std::uint64_t offset, const std::string& what) const {
  return {ErrorCode::kDataLoss, file_.string() + ": byte " + std::to_string(offset) + ": " + what,
          "file"};
}

Result<std::string> TarReader::Take(std::uint64_t count, const std::string& what) {
  std::string bytes(count, '\0');
  std::size_t read = 0;
  while (read < bytes.size()) {
    const ssize_t got = ::pread(descriptor_, bytes.data() + read, bytes.size() - read,
                                static_cast<off_t>(position_ + read));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return FromErrno(errno, file_, "cannot be read");
    if (got == 0) return Damaged(position_ + read, "the file ends here, within " + what);
    read += static_cast<std::size_t>(got);
  }
  position_ += count;
  return bytes;
}

Result<std::optional<TarEntry>> TarReader::Next() {
  const auto skip_rest = [this]() -> Status {
    const std::uint64_t end = position_ + left_ + padding_;
    if (end > size_) return Damaged(size_, "the file ends here, within " + name_);
    position_ = end;
    left_ = 0;
    padding_ = 0;
    return {};
  };
  if (Status skipped = skip_rest(); !skipped) return skipped.error();
  std::string long_name;
  std::optional<std::uint64_t> long_size;
  for (;;) {
    const std::uint64_t begin = position_;
    const Result<std::string> header = Take(kBlock, "the archive: its end mark is missing");
    if (!header) return header.error();
    if (header->find_first_not_of('\0') == std::string::npos) {
      const Result<std::string> second = Take(kBlock, "its end mark");
      if (!second) return second.error();
      return std::optional<TarEntry>();
    }
    const std::optional<std::uint64_t> bytes = OctalOf(*header, kSize);
    if (OctalOf(*header, kChecksum) != ChecksumOf(*header) || !bytes) {
      return Damaged(begin, begin == 0 ? "this is no tar archive" : "the header here is damaged");
    }
    const char type = (*header)[kType];
    if (type == 'x') {
      constexpr std::uint64_t kLongest = std::uint64_t{1} << 20;
      if (*bytes > kLongest) return Damaged(begin, "the pax record here is too long");
      const Result<std::string> records = Take(*bytes + PaddingOf(*bytes), "a pax record");
      if (!records) return records.error();
      std::string_view left(records->data(), *bytes);
      while (!left.empty()) {
        const std::size_t blank = left.find(' ');
        const auto length = ParseInteger(left.substr(0, std::min(blank, left.size())));
        const auto size = static_cast<std::size_t>(length.value_or(0));
        if (blank == std::string_view::npos || length.value_or(-1) < 0 || size <= blank + 1 ||
            size > left.size() || left[size - 1] != '\n') {
          return Damaged(begin, "the pax record here is damaged");
        }
        const std::string_view record = left.substr(blank + 1, size - blank - 2);
        if (record.starts_with("path=")) long_name = record.substr(5);
        if (record.starts_with("size=")) {
          const auto number = ParseInteger(record.substr(5));
          if (!number || *number < 0) return Damaged(begin, "the pax record here is damaged");
          long_size = static_cast<std::uint64_t>(*number);
        }
        left.remove_prefix(size);
      }
      continue;
    }
    if (type != '0' && type != '\0') {
      return Damaged(begin, std::string("an entry of type '") + type + "' is none of a backup");
    }
    TarEntry entry;
    const std::string prefix(TextOf(*header, kPrefix));
    entry.name = !long_name.empty()
                     ? long_name
                     : (prefix.empty() ? "" : prefix + "/") + std::string(TextOf(*header, kName));
    entry.bytes = long_size.value_or(*bytes);
    entry.offset = position_;
    if (entry.bytes > size_ - position_) {
      return Damaged(size_, "the file ends here, within " + entry.name + ", which should have " +
                                std::to_string(entry.bytes) + " bytes from byte " +
                                std::to_string(position_) + " on");
    }
    name_ = entry.name;
    left_ = entry.bytes;
    padding_ = PaddingOf(entry.bytes);
    return std::optional(std::move(entry));
  }
}

Result<std::string> TarReader::Read() {
  constexpr std::uint64_t kPiece = std::uint64_t{256} << 10;
  const std::uint64_t count = std::min(kPiece, left_);
  Result<std::string> bytes = Take(count, name_);
  if (bytes) left_ -= count;
  return bytes;
}

}  // namespace exemplar::backup
