#pragma once
// The dead-man switch on ircp/safety.

#include <atomic>
#include <cstdint>
#include <map>
#include <string>

#include "exemplar/ircp/samples.hpp"

namespace exemplar::executor {

/// The switch of whoever pressed it last while nobody else did: from then on that one alone counts,
/// until it is released or falls silent. A press counts only after the same source was heard with
/// its switch released. Take belongs to one thread, the rest is thread-safe.
class DeadMan {
 public:
  explicit DeadMan(Duration patience) : patience_(patience) {}

  /// True for a press that counts.
  bool Take(const ircp::SafetySample& sample, Duration steady);

  /// As it was said last, however long ago.
  bool held() const { return held_.load(std::memory_order_acquire); }
  /// Whether whoever holds it was heard within the patience; true while nobody does.
  bool heard(Duration steady) const;
  std::uint64_t presses() const { return presses_.load(std::memory_order_acquire); }
  /// The stamp, on its writer's clock, of the press that counted last; 0 before the first.
  Stamp pressed() const {
    return Stamp::FromNanoseconds(pressed_ns_.load(std::memory_order_acquire));
  }

 private:
  struct Source {
    bool held = false;
    Duration received{0};
  };
  const Duration patience_;
  std::map<std::string, Source> sources_;
  std::string holder_;  ///< empty: nobody
  std::atomic<bool> held_{false};
  std::atomic<std::int64_t> received_ns_{0};  ///< from the holder
  std::atomic<std::int64_t> pressed_ns_{0};
  std::atomic<std::uint64_t> presses_{0};
};

}  // namespace exemplar::executor
