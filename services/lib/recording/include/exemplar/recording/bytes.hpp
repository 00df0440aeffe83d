#pragma once
// Where the codec's bytes go to and come from: ports with a file twin (file.hpp) and an in-memory
// twin, so that the codec itself knows no file.

#include <cstdint>
#include <span>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::recording {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

/// Takes bytes in order. Thread-compatible.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// Appends all of `bytes` or none of them.
  virtual Status Write(ByteView bytes) = 0;
  /// When it returns, what was written survives a crash of the machine, as far as the sink can say.
  virtual Status Sync() = 0;
};

/// Bytes that can be read at any place. Thread-compatible.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  /// Fills `out` from `offset`; returns how many bytes there were, fewer only at the end.
  virtual Result<std::size_t> Read(std::uint64_t offset, std::span<std::uint8_t> out) = 0;
};

/// Bytes that a writer puts aside until it closes.
class ByteScratch : public ByteSink, public ByteSource {};

class MemorySink final : public ByteSink {
 public:
  Status Write(ByteView bytes) override;
  Status Sync() override;
  const Bytes& bytes() const { return bytes_; }
  /// How many bytes the last Sync covered.
  std::size_t synced() const { return synced_; }

 private:
  Bytes bytes_;
  std::size_t synced_ = 0;
};

/// Does not own the bytes: they must outlive it.
class MemorySource final : public ByteSource {
 public:
  explicit MemorySource(ByteView bytes) : bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_.size(); }
  Result<std::size_t> Read(std::uint64_t offset, std::span<std::uint8_t> out) override;

 private:
  ByteView bytes_;
};

class MemoryScratch final : public ByteScratch {
 public:
  Status Write(ByteView bytes) override { return sink_.Write(bytes); }
  Status Sync() override { return {}; }
  std::uint64_t size() const override { return sink_.bytes().size(); }
  Result<std::size_t> Read(std::uint64_t offset, std::span<std::uint8_t> out) override;

 private:
  MemorySink sink_;
};

}  // namespace exemplar::recording
