#include "cdr_layout.hpp"

#include <cstring>
#include <string>

namespace exemplar::bus {
namespace {

constexpr std::size_t kEncapsulationBytes = 4;
constexpr std::size_t kMostPadding = 3;

class Walker {
 public:
  Walker(std::span<const std::uint8_t> body, bool little_endian)
      : body_(body), little_endian_(little_endian) {}

  Status Walk(std::string_view layout) {
    for (std::size_t i = 0; i < layout.size(); ++i) {
      if (layout[i] != '[') {
        Take(layout[i]);
      } else {
        const std::size_t close = layout.find(']', i);
        TakeSequence(layout.substr(i + 1, close - i - 1));
        i = close;
      }
      if (!status_.ok()) return status_;
    }
    return status_;
  }

  std::size_t left() const { return body_.size() - position_; }

 private:
  void TakeSequence(std::string_view element) {
    const std::uint32_t count = TakeLength();
    if (element == "8" && count > 0) {
      Skip(8, std::size_t{count} * 8);
      return;
    }
    for (std::uint32_t k = 0; k < count && status_.ok(); ++k) {
      for (const char letter : element) Take(letter);
    }
  }

  void Take(char letter) {
    switch (letter) {
      case '8':
        return Skip(8, 8);
      case '4':
        return Skip(4, 4);
      case 'b':
        return Skip(1, 1);
      case 's':
        return TakeString();
      default:
        return Skip(1, TakeLength());
    }
  }

  /// Ends with its only NUL; a length of 0 stands for the empty string with some writers.
  void TakeString() {
    const std::uint32_t length = TakeLength();
    Skip(1, length);
    if (!status_.ok() || length == 0) return;
    const std::uint8_t* text = body_.data() + position_ - length;
    const void* first_nul = std::memchr(text, 0, length);
    if (first_nul == text + length - 1) return;
    status_ = Error{ErrorCode::kDataLoss,
                    "byte " + std::to_string(position_ - length + kEncapsulationBytes) +
                        ": a string must end with its only NUL"};
  }

  std::uint32_t TakeLength() {
    Skip(4, 4);
    if (!status_.ok()) return 0;
    const std::uint8_t* p = body_.data() + position_ - 4;
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i) {
      value |= std::uint32_t{p[i]} << (8 * (little_endian_ ? i : 3 - i));
    }
    return value;
  }

  void Skip(std::size_t alignment, std::size_t bytes) {
    if (!status_.ok()) return;
    const std::size_t padding = (alignment - position_ % alignment) % alignment;
    if (padding + bytes > left()) {
      status_ = Error{ErrorCode::kDataLoss,
                      "byte " + std::to_string(position_ + kEncapsulationBytes) + ": " +
                          std::to_string(padding + bytes) + " bytes are due, " +
                          std::to_string(left()) + " are left"};
      return;
    }
    position_ += padding + bytes;
  }

  std::span<const std::uint8_t> body_;
  bool little_endian_;
  std::size_t position_ = 0;
  Status status_;
};

}  // namespace

Status CheckCdrLayout(std::span<const std::uint8_t> cdr, std::string_view layout) {
  if (cdr.size() < kEncapsulationBytes) {
    return Error{ErrorCode::kDataLoss, std::to_string(cdr.size()) +
                                           " bytes are too few for an encapsulation header of 4"};
  }
  if (cdr[0] != 0 || cdr[1] > 1) {
    return Error{ErrorCode::kDataLoss, "encapsulation " + std::to_string(cdr[0]) + " " +
                                           std::to_string(cdr[1]) +
                                           " is not plain CDR (0 0 or 0 1)"};
  }
  Walker walker(cdr.subspan(kEncapsulationBytes), cdr[1] == 1);
  if (Status walked = walker.Walk(layout); !walked.ok()) return walked;
  if (walker.left() > kMostPadding) {
    return Error{ErrorCode::kDataLoss,
                 std::to_string(walker.left()) + " bytes are left over after the last field"};
  }
  return {};
}

}  // namespace exemplar::bus
