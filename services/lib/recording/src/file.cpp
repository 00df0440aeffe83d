#include "exemplar/recording/file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace exemplar::recording {
namespace {

Error FromErrno(int number, const std::filesystem::path& path, const std::string& what) {
  ErrorCode code = ErrorCode::kInternal;
  switch (number) {
    case EEXIST:
      code = ErrorCode::kAlreadyExists;
      break;
    case ENOENT:
    case ENOTDIR:
      code = ErrorCode::kNotFound;
      break;
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
    case EMFILE:
      code = ErrorCode::kResourceExhausted;
      break;
    case EACCES:
    case EPERM:
    case EROFS:
      code = ErrorCode::kFailedPrecondition;
      break;
    default:
      break;
  }
  return {code, path.string() + ": " + what + ": " + std::strerror(number), "path"};
}

/// Makes a new name in a folder durable.
Status SyncFolder(const std::filesystem::path& file) {
  const std::filesystem::path folder =
      file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return FromErrno(errno, folder, "cannot be opened");
  const int synced = ::fsync(descriptor);
  const int number = errno;
  ::close(descriptor);
  // Some file systems cannot sync a folder; the file itself is synced all the same.
  if (synced != 0 && number != EINVAL) return FromErrno(number, folder, "cannot be synced");
  return {};
}

/// All of `bytes` at the file's end, or nothing; `size` is the file's size.
Status Append(int descriptor, ByteView bytes, const std::filesystem::path& path,
              std::uint64_t& size) {
  std::size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t count = ::write(descriptor, bytes.data() + written, bytes.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const int number = count < 0 ? errno : ENOSPC;
      const bool undone = ::ftruncate(descriptor, static_cast<off_t>(size)) == 0 &&
                          ::lseek(descriptor, static_cast<off_t>(size), SEEK_SET) >= 0;
      return FromErrno(number, path,
                       undone ? "cannot be written" : "cannot be written, and ends in a cut write");
    }
    written += static_cast<std::size_t>(count);
  }
  size += written;
  return {};
}

Result<std::size_t> ReadAt(int descriptor, std::uint64_t offset, std::span<std::uint8_t> out,
                           const std::filesystem::path& path) {
  std::size_t read = 0;
  while (read < out.size()) {
    const ssize_t count = ::pread(descriptor, out.data() + read, out.size() - read,
                                  static_cast<off_t>(offset + read));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return FromErrno(errno, path, "cannot be read");
    if (count == 0) break;
    read += static_cast<std::size_t>(count);
  }
  return read;
}

}  // namespace

FileSink::FileSink(int descriptor, std::filesystem::path path)
    : descriptor_(descriptor), path_(std::move(path)) {}

FileSink::~FileSink() { ::close(descriptor_); }

Result<std::unique_ptr<FileSink>> FileSink::Create(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (descriptor < 0) return FromErrno(errno, path, "cannot be created");
  std::unique_ptr<FileSink> sink(new FileSink(descriptor, path));
  if (const Status synced = SyncFolder(path); !synced.ok()) return synced.error();
  return sink;
}

Status FileSink::Write(ByteView bytes) { return Append(descriptor_, bytes, path_, size_); }

Status FileSink::Sync() {
  if (::fdatasync(descriptor_) != 0) return FromErrno(errno, path_, "cannot be synced");
  return {};
}

FileSource::FileSource(int descriptor, std::uint64_t size, std::filesystem::path path)
    : descriptor_(descriptor), size_(size), path_(std::move(path)) {}

FileSource::~FileSource() { ::close(descriptor_); }

Result<std::unique_ptr<FileSource>> FileSource::Open(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return FromErrno(errno, path, "cannot be opened");
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(descriptor);
    return InvalidArgument(path.string() + ": is not a file", "path");
  }
  return std::unique_ptr<FileSource>(
      new FileSource(descriptor, static_cast<std::uint64_t>(status.st_size), path));
}

Result<std::size_t> FileSource::Read(std::uint64_t offset, std::span<std::uint8_t> out) {
  return ReadAt(descriptor_, offset, out, path_);
}

FileScratch::FileScratch(int descriptor, std::filesystem::path folder)
    : descriptor_(descriptor), folder_(std::move(folder)) {}

FileScratch::~FileScratch() { ::close(descriptor_); }

Result<std::unique_ptr<FileScratch>> FileScratch::Create(const std::filesystem::path& folder) {
  std::string name = (folder / ".exemplar-scratch-XXXXXX").string();
  const int descriptor = ::mkostemp(name.data(), O_CLOEXEC);
  if (descriptor < 0) return FromErrno(errno, folder, "no scratch file can be made there");
  ::unlink(name.c_str());
  return std::unique_ptr<FileScratch>(new FileScratch(descriptor, folder));
}

Status FileScratch::Write(ByteView bytes) { return Append(descriptor_, bytes, folder_, size_); }

Result<std::size_t> FileScratch::Read(std::uint64_t offset, std::span<std::uint8_t> out) {
  return ReadAt(descriptor_, offset, out, folder_);
}

}  // namespace exemplar::recording
