#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace exemplar::recorder {

/// What every type under exemplar::ircp begins with (idl/common.idl).
struct SampleHeader {
  std::string source;
  std::uint64_t seq = 0;
};

/// Reads it from a sample's CDR bytes (XCDR1, either byte order, with encapsulation); nullopt when
/// they are too short for it.
std::optional<SampleHeader> ReadSampleHeader(std::span<const std::uint8_t> cdr);

}  // namespace exemplar::recorder
