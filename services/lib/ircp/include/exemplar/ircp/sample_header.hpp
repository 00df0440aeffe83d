#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace exemplar::ircp {

/// What every type under exemplar::ircp begins with (idl/common.idl): its keys, of which `source`
/// is the first and all are strings, and then `seq`.
struct SampleHeader {
  std::string source;
  std::uint64_t seq = 0;
};

struct HeaderLayout {
  int keys = 1;
};

/// The layout that a type's flattened IDL tells; nullopt for types that begin otherwise.
/// `type` is the name on the network ("exemplar::ircp::v1::Suit").
std::optional<HeaderLayout> ReadHeaderLayout(std::string_view idl, std::string_view type);

/// Reads the header from a sample's CDR bytes (XCDR1, either byte order, with encapsulation);
/// nullopt when they are too short for it.
std::optional<SampleHeader> ReadSampleHeader(std::span<const std::uint8_t> cdr,
                                             HeaderLayout layout = {});

/// The sample's keys as the network's key hash wants them before it hashes: strings in big-endian
/// CDR. nullopt as above.
std::optional<std::vector<std::uint8_t>> ReadSampleKeys(std::span<const std::uint8_t> cdr,
                                                        HeaderLayout layout);

}  // namespace exemplar::ircp
