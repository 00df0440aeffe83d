#pragma once
// Tar archives as POSIX.1-2001 has them (ustar headers, pax records for long names and sizes of
// 8 GiB and more): what a backup file is, so that every tar program opens it.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "exemplar/base/result.hpp"

namespace exemplar::backup {

/// A regular file in an archive.
struct TarEntry {
  std::string name;
  std::uint64_t bytes = 0;
  std::uint64_t offset = 0;  ///< of its bytes in the archive
};

/// Writes FILE.part, which becomes FILE when it is finished, and goes when it is not.
/// Thread-compatible.
class TarWriter {
 public:
  /// kAlreadyExists when FILE is there.
  static Result<std::unique_ptr<TarWriter>> Create(const std::filesystem::path& file);
  ~TarWriter();
  TarWriter(const TarWriter&) = delete;
  TarWriter& operator=(const TarWriter&) = delete;

  /// Precondition: the entry before has all its bytes. `mtime_s`: seconds since 1970.
  Status Begin(const std::string& name, std::uint64_t bytes, std::int64_t mtime_s);
  /// kInternal where the entry gets more bytes than it was to have.
  Status Write(std::string_view bytes);
  /// On the disk under its own name when it returns.
  Status Finish();

 private:
  TarWriter(std::filesystem::path file, std::filesystem::path part, int descriptor);
  Status Put(std::string_view bytes);
  Status Pad();

  const std::filesystem::path file_;
  const std::filesystem::path part_;
  int descriptor_;
  std::uint64_t written_ = 0;
  std::uint64_t left_ = 0;  ///< of the entry
  bool finished_ = false;
};

/// Reads an archive from its beginning. Errors are kDataLoss and name the file and the byte.
/// Thread-compatible.
class TarReader {
 public:
  static Result<std::unique_ptr<TarReader>> Open(const std::filesystem::path& file);
  ~TarReader();
  TarReader(const TarReader&) = delete;
  TarReader& operator=(const TarReader&) = delete;

  /// Passes over what was not read of the entry before. nullopt behind the end mark.
  Result<std::optional<TarEntry>> Next();
  /// The entry's next bytes, at most 256 KiB; empty at its end.
  Result<std::string> Read();
  std::uint64_t size() const { return size_; }
  std::uint64_t position() const { return position_; }

 private:
  TarReader(std::filesystem::path file, int descriptor, std::uint64_t size);
  Result<std::string> Take(std::uint64_t count, const std::string& what);
  Error Damaged(std::uint64_t offset, const std::string& what) const;

  const std::filesystem::path file_;
  const int descriptor_;
  const std::uint64_t size_;
  std::uint64_t position_ = 0;
  std::uint64_t left_ = 0;     ///< of the entry
  std::uint64_t padding_ = 0;  ///< behind it
  std::string name_;
};

}  // namespace exemplar::backup
