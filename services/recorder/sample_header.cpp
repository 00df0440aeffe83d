#include "recorder/sample_header.hpp"

namespace exemplar::recorder {
namespace {

constexpr std::size_t kEncapsulation = 4;

std::uint64_t ReadNumber(std::span<const std::uint8_t> bytes, bool little_endian) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    value = (value << 8) | bytes[little_endian ? bytes.size() - 1 - i : i];
  }
  return value;
}

}  // namespace

std::optional<SampleHeader> ReadSampleHeader(std::span<const std::uint8_t> cdr) {
  if (cdr.size() < kEncapsulation + 4) return std::nullopt;
  // The second byte is 0 for big-endian and 1 for little-endian plain CDR; others are not ours.
  if (cdr[0] != 0 || cdr[1] > 1) return std::nullopt;
  const bool little_endian = cdr[1] == 1;
  const std::span<const std::uint8_t> body = cdr.subspan(kEncapsulation);
  const std::uint64_t length = ReadNumber(body.first(4), little_endian);  // with its final zero
  if (length == 0 || length > body.size() - 4) return std::nullopt;
  const std::size_t end = 4 + static_cast<std::size_t>(length);
  const std::size_t seq = (end + 7) / 8 * 8;
  if (seq + 8 > body.size()) return std::nullopt;
  SampleHeader header;
  header.source.assign(body.begin() + 4, body.begin() + static_cast<std::ptrdiff_t>(end) - 1);
  header.seq = ReadNumber(body.subspan(seq, 8), little_endian);
  return header;
}

}  // namespace exemplar::recorder
