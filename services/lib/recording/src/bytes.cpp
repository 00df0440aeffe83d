#include "exemplar/recording/bytes.hpp"

#include <algorithm>

namespace exemplar::recording {

Status MemorySink::Write(ByteView bytes) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  return {};
}

Status MemorySink::Sync() {
  synced_ = bytes_.size();
  return {};
}

Result<std::size_t> MemorySource::Read(std::uint64_t offset, std::span<std::uint8_t> out) {
  if (offset >= bytes_.size()) return std::size_t{0};
  const std::size_t count = std::min(out.size(), bytes_.size() - static_cast<std::size_t>(offset));
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), count, out.begin());
  return count;
}

Result<std::size_t> MemoryScratch::Read(std::uint64_t offset, std::span<std::uint8_t> out) {
  return MemorySource(sink_.bytes()).Read(offset, out);
}

}  // namespace exemplar::recording
