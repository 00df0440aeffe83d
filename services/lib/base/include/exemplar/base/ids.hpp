#pragma once
#include <string>
#include <string_view>

#include "exemplar/base/rng.hpp"

namespace exemplar {

/// 16 lower-case hexadecimal digits of `rng`, behind `prefix` and a dash: "trial-0f3c…".
std::string MakeId(std::string_view prefix, Rng& rng);

/// A seed from the machine's entropy: for programs, never for tests.
std::uint64_t EntropySeed();

/// 16 hexadecimal digits of the bytes' FNV-1a hash: names content, protects against nothing.
std::string ContentHash(std::string_view bytes);

}  // namespace exemplar
