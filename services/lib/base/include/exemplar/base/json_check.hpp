#pragma once
#include <cstddef>
#include <optional>
#include <string_view>

namespace exemplar {

/// Why a text from outside is no JSON to make a tree of.
struct JsonFault {
  bool too_deep = false;  ///< else it is not JSON
  std::size_t byte = 0;   ///< where reading ended, from 1
};

/// Reads all of the text and keeps nothing of it; nullopt where it is JSON (RFC 8259) in which
/// objects and arrays nest at most `deepest` times.
std::optional<JsonFault> FindJsonFault(std::string_view text, int deepest);

}  // namespace exemplar
