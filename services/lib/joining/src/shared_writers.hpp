#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "facts.hpp"

namespace exemplar::joining {

/// Numbers that have come, however many gaps there are. Thread-compatible.
class NumberSet {
 public:
  /// False when it was there already.
  bool Insert(std::uint64_t number);
  std::uint64_t size() const { return size_; }
  /// How many numbers lie within [first, last] and are not in the set.
  std::uint64_t MissingBetween(std::uint64_t first, std::uint64_t last) const;

 private:
  std::map<std::uint64_t, std::uint64_t> intervals_;  ///< first -> last, never touching
  std::uint64_t size_ = 0;
};

/// The writers that more than one recorder heard: each sample counts once, and is lost only where
/// nobody has it. Thread-compatible.
class SharedWriters {
 public:
  using Writer = std::pair<std::string, std::string>;  ///< topic and identity on the network

  explicit SharedWriters(const std::vector<Facts>& files);

  /// Whether the sample is to be written: the first of its number.
  bool Take(std::size_t file, const Writer& writer, std::uint64_t number);
  /// "exemplar.losses" of all writers: of those in one file only as that file has them.
  std::vector<recording::StringMap> Losses() const;

 private:
  struct Heard {
    NumberSet numbers;
    std::map<std::size_t, std::pair<std::uint64_t, std::uint64_t>> ranges;  ///< by file
  };
  const std::vector<Facts>& files_;
  std::map<Writer, Heard> shared_;
};

}  // namespace exemplar::joining
