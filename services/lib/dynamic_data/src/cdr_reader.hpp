#pragma once
#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "exemplar/base/result.hpp"
#include "exemplar/dynamic_data/type.hpp"

namespace exemplar::dynamic_data {

/// Thrown where the bytes do not fit the type; caught before it leaves the library. `path` grows on
/// the way out.
struct Misfit {
  std::string message;
  std::string path = {};

  /// Puts the outer part before it: "objects" before "[2].name".
  void Within(const std::string& outer) {
    path = path.empty() || path.front() == '[' ? outer + path : outer + '.' + path;
  }
};

/// Takes numbers from plain CDR. Thread-compatible.
class CdrReader {
 public:
  /// Throws Misfit for encapsulations that are not plain CDR.
  explicit CdrReader(std::span<const std::uint8_t> cdr);

  template <class Number>
  Number Take() {
    const std::span<const std::uint8_t> bytes = Bytes(sizeof(Number), sizeof(Number));
    std::uint64_t raw = 0;
    for (std::size_t i = 0; i < sizeof(Number); ++i) {
      raw = (raw << 8) | bytes[little_endian_ ? sizeof(Number) - 1 - i : i];
    }
    return FromBits<Number>(raw);
  }
  /// Without its zero.
  std::string_view TakeString();
  std::span<const std::uint8_t> TakeBytes(std::size_t count) { return Bytes(1, count); }
  /// Before collections of other than numbers, where the encoding has it.
  void SkipCollectionHeader(const Type& element);
  /// Throws unless `count` elements that take `least_bytes` each could still come.
  void Require(std::size_t count, std::size_t least_bytes) const;
  /// Throws where more is left than padding.
  void Finish() const;

 private:
  template <class Number>
  static Number FromBits(std::uint64_t raw) {
    if constexpr (std::is_same_v<Number, float>) {
      return std::bit_cast<float>(static_cast<std::uint32_t>(raw));
    } else if constexpr (std::is_same_v<Number, double>) {
      return std::bit_cast<double>(raw);
    } else {
      return static_cast<Number>(raw);
    }
  }
  std::span<const std::uint8_t> Bytes(std::size_t alignment, std::size_t count);
  [[noreturn]] void Fail(const std::string& what) const;

  std::span<const std::uint8_t> body_;
  bool little_endian_ = true;
  bool version2_ = false;
  std::size_t position_ = 0;
};

/// Of one byte to eight, booleans among them.
bool IsNumber(const Type& type);
/// The case of a union that goes with the discriminator; nullptr: none.
const Type::Member* CaseOf(const Type& type, std::int64_t discriminator);

}  // namespace exemplar::dynamic_data
