#pragma once
// Plain CDR (XCDR1): numbers are aligned to their size, counted from behind the encapsulation
// header.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::ros2 {

inline constexpr std::size_t kEncapsulation = 4;

/// Little-endian.
class CdrWriter {
 public:
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void Put(Number value) {
    static_assert(std::endian::native == std::endian::little);
    while ((bytes_.size() - kEncapsulation) % sizeof(Number) != 0) bytes_.push_back(0);
    const auto raw = std::bit_cast<std::array<std::uint8_t, sizeof(Number)>>(value);
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
  }
  void Put(std::string_view text) {
    Put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.push_back(0);
  }
  template <class Element>
  void Put(const std::vector<Element>& elements) {
    Put(static_cast<std::uint32_t>(elements.size()));
    for (const Element& element : elements) Put(element);
  }
  void Put(const std::string& text) { Put(std::string_view(text)); }
  std::vector<std::uint8_t> Take() && { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_ = {0, 1, 0, 0};
};

/// The first fault ends it: what is read after that stays as it was.
class CdrReader {
 public:
  explicit CdrReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
    if (bytes.size() < kEncapsulation || bytes[0] != 0 || bytes[1] > 1) {
      Fail("is no plain CDR");
    } else {
      swapped_ = bytes[1] == 0;
    }
  }

  template <class Number>
  requires std::is_arithmetic_v<Number>
  void Get(Number& value) {
    if (!status_.ok()) return;
    const std::size_t past = (at_ - kEncapsulation) % sizeof(Number);
    const std::size_t from = at_ + (past == 0 ? 0 : sizeof(Number) - past);
    if (from > bytes_.size() || bytes_.size() - from < sizeof(Number)) return Fail("ends early");
    std::array<std::uint8_t, sizeof(Number)> raw;
    std::memcpy(raw.data(), bytes_.data() + from, sizeof(Number));
    if (swapped_) std::reverse(raw.begin(), raw.end());
    value = std::bit_cast<Number>(raw);
    at_ = from + sizeof(Number);
  }
  void Get(std::string& text) {
    std::uint32_t size = 0;
    Get(size);
    if (!status_.ok() || size == 0) return;  // some writers send an empty string as no byte at all
    if (bytes_.size() - at_ < size) return Fail("has a text that goes past its end");
    text.assign(reinterpret_cast<const char*>(bytes_.data()) + at_, size - 1);
    at_ += size;
  }
  template <class Element>
  void Get(std::vector<Element>& elements) {
    std::uint32_t count = 0;
    Get(count);
    // An element takes at least four bytes, so that no count can make this allocate much.
    count = AtMost(count, 4);
    elements.reserve(count);
    for (std::uint32_t i = 0; i < count && status_.ok(); ++i) Get(elements.emplace_back());
  }
  /// `count` of a sequence whose elements take at least `bytes` each; 0, and a fault, where so many
  /// cannot be there.
  std::uint32_t AtMost(std::uint32_t count, std::size_t bytes) {
    if (!status_.ok()) return 0;
    if (count <= left() / bytes) return count;
    Fail("counts more than it holds");
    return 0;
  }
  std::size_t left() const { return bytes_.size() - at_; }
  const Status& status() const { return status_; }

 private:
  void Fail(const char* what) {
    status_ = InvalidArgument("a ROS 2 message of " + std::to_string(bytes_.size()) + " bytes " +
                              what + " (at byte " + std::to_string(at_) + ")");
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = kEncapsulation;
  bool swapped_ = false;
  Status status_;
};

}  // namespace exemplar::ros2
