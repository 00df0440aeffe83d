#pragma once
// The file twins of the byte ports.

#include <filesystem>
#include <memory>

#include "exemplar/recording/bytes.hpp"

namespace exemplar::recording {

/// A new file. A write that fails (a full disk) leaves the file as it was before that write, so it
/// always ends at the end of a write. Thread-compatible; closes on destruction.
class FileSink final : public ByteSink {
 public:
  /// kAlreadyExists when there is such a file: a recording is never overwritten, and of two
  /// recorders with one name the second is told. The folder must exist. The file's name is durable
  /// when it returns.
  static Result<std::unique_ptr<FileSink>> Create(const std::filesystem::path& path);
  ~FileSink() override;
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  Status Write(ByteView bytes) override;
  Status Sync() override;
  std::uint64_t size() const { return size_; }

 private:
  FileSink(int descriptor, std::filesystem::path path);

  int descriptor_;
  std::filesystem::path path_;
  std::uint64_t size_ = 0;
};

/// An existing file. Thread-compatible.
class FileSource final : public ByteSource {
 public:
  static Result<std::unique_ptr<FileSource>> Open(const std::filesystem::path& path);
  ~FileSource() override;
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  std::uint64_t size() const override { return size_; }
  Result<std::size_t> Read(std::uint64_t offset, std::span<std::uint8_t> out) override;

 private:
  FileSource(int descriptor, std::uint64_t size, std::filesystem::path path);

  int descriptor_;
  std::uint64_t size_;
  std::filesystem::path path_;
};

/// A file without name, gone when it is closed. Thread-compatible.
class FileScratch final : public ByteScratch {
 public:
  static Result<std::unique_ptr<FileScratch>> Create(const std::filesystem::path& folder);
  ~FileScratch() override;
  FileScratch(const FileScratch&) = delete;
  FileScratch& operator=(const FileScratch&) = delete;

  Status Write(ByteView bytes) override;
  Status Sync() override { return {}; }
  std::uint64_t size() const override { return size_; }
  Result<std::size_t> Read(std::uint64_t offset, std::span<std::uint8_t> out) override;

 private:
  FileScratch(int descriptor, std::filesystem::path folder);

  int descriptor_;
  std::filesystem::path folder_;
  std::uint64_t size_ = 0;
};

}  // namespace exemplar::recording
