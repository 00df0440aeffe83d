#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "exemplar/base/result.hpp"

namespace exemplar::bus {

/// Walks CDR bytes along `layout` without allocating: the generated code resizes sequences to
/// whatever length the bytes claim, so it sees only bytes that passed here. Layout letters:
///   s string   8 eight-byte number   4 four-byte number   b boolean   o octets (a sequence)
///   [...] sequence of ...
/// The error says at which byte.
Status CheckCdrLayout(std::span<const std::uint8_t> cdr_with_encapsulation,
                      std::string_view layout);

}  // namespace exemplar::bus
