#include "cdr_reader.hpp"

#include <algorithm>

namespace exemplar::dynamic_data {
namespace {

constexpr std::size_t kEncapsulation = 4;
constexpr std::size_t kMostPadding = 7;

}  // namespace

CdrReader::CdrReader(std::span<const std::uint8_t> cdr) {
  if (cdr.size() < kEncapsulation) {
    throw Misfit{std::to_string(cdr.size()) +
                 " bytes are too few for an encapsulation header of 4"};
  }
  const bool known = cdr[0] == 0 && (cdr[1] <= 1 || cdr[1] == 6 || cdr[1] == 7);
  if (!known) {
    throw Misfit{"encapsulation " + std::to_string(cdr[0]) + " " + std::to_string(cdr[1]) +
                 " is not plain CDR (0 0, 0 1, 0 6 or 0 7)"};
  }
  little_endian_ = cdr[1] % 2 == 1;
  version2_ = cdr[1] > 1;
  body_ = cdr.subspan(kEncapsulation);
}

void CdrReader::Fail(const std::string& what) const {
  throw Misfit{"byte " + std::to_string(position_ + kEncapsulation) + ": " + what};
}

std::span<const std::uint8_t> CdrReader::Bytes(std::size_t alignment, std::size_t count) {
  if (version2_) alignment = std::min<std::size_t>(alignment, 4);
  const std::size_t padding = (alignment - position_ % alignment) % alignment;
  const std::size_t left = body_.size() - position_;
  if (padding > left || count > left - padding) {
    Fail(std::to_string(count) + " bytes are due, " +
         std::to_string(padding > left ? 0 : left - padding) + " are left");
  }
  position_ += padding + count;
  return body_.subspan(position_ - count, count);
}

std::string_view CdrReader::TakeString() {
  const auto length = Take<std::uint32_t>();
  if (length == 0) return {};  // some writers' empty string
  const std::span<const std::uint8_t> bytes = Bytes(1, length);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.find('\0') != text.size() - 1) Fail("a string must end with its only NUL");
  return text.substr(0, text.size() - 1);
}

bool IsNumber(const Type& type) { return type.kind <= Kind::kFloat64; }

const Type::Member* CaseOf(const Type& type, std::int64_t discriminator) {
  const Type::Member* otherwise = nullptr;
  for (const Type::Member& member : type.members) {
    const auto& labels = member.labels;
    if (std::find(labels.begin(), labels.end(), discriminator) != labels.end()) return &member;
    if (member.is_default) otherwise = &member;
  }
  return otherwise;
}

void CdrReader::SkipCollectionHeader(const Type& element) {
  if (version2_ && !IsNumber(element)) Take<std::uint32_t>();
}

void CdrReader::Require(std::size_t count, std::size_t least_bytes) const {
  const std::size_t left = body_.size() - position_;
  if (least_bytes != 0 && count > left / least_bytes) {
    Fail(std::to_string(count) + " elements of " + std::to_string(least_bytes) +
         " bytes or more are due, " + std::to_string(left) + " bytes are left");
  }
}

void CdrReader::Finish() const {
  const std::size_t left = body_.size() - position_;
  if (left > kMostPadding) Fail(std::to_string(left) + " bytes are left over");
}

}  // namespace exemplar::dynamic_data
