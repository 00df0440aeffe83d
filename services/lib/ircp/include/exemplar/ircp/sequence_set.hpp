#pragma once
#include <cstdint>
#include <map>

namespace exemplar::ircp {

/// Which of a writer's numbers have come, in whatever order: what is missing between the lowest and
/// the highest is lost. Memory stays bounded: beyond kMaxGaps open gaps the lowest ones are closed,
/// that is, they stay lost. Thread-compatible.
class SequenceSet {
 public:
  static constexpr std::size_t kMaxGaps = 1024;

  /// False when `seq` was there already (or lies in a closed gap).
  bool Insert(std::uint64_t seq);
  std::uint64_t received() const { return received_; }
  std::uint64_t lost() const { return received_ == 0 ? 0 : highest_ - lowest_ + 1 - received_; }
  std::uint64_t highest() const { return highest_; }

 private:
  std::map<std::uint64_t, std::uint64_t> intervals_;  ///< first -> last, never touching
  std::uint64_t received_ = 0;
  std::uint64_t lowest_ = 0;
  std::uint64_t highest_ = 0;
};

}  // namespace exemplar::ircp
