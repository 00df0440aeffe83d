#include "executor/teleoperation_dead_man.hpp"

namespace exemplar::executor {

bool DeadMan::Take(const ircp::SafetySample& sample, Duration steady) {
  const bool held = sample.dead_man_held && !sample.emergency_stop;
  const auto [found, is_new] = sources_.try_emplace(sample.header.source);
  Source& source = found->second;
  const bool pressed = held && !is_new && !source.held && steady - source.received <= patience_;
  // Held from the first sample on, or after a silence, counts for nothing until it is released.
  if (!holder_.empty() && holder_ != sample.header.source && !heard(steady)) {
    holder_.clear();
    held_.store(false, std::memory_order_release);
  }
  bool counts = false;
  if (pressed && holder_.empty()) {
    holder_ = sample.header.source;
    received_ns_.store(steady.count(), std::memory_order_relaxed);
    held_.store(true, std::memory_order_release);
    pressed_ns_.store(sample.header.stamp.nanoseconds(), std::memory_order_release);
    presses_.fetch_add(1, std::memory_order_acq_rel);
    counts = true;
  } else if (holder_ == sample.header.source) {
    if (!held || !heard(steady)) {
      holder_.clear();
      held_.store(false, std::memory_order_release);
    }
    received_ns_.store(steady.count(), std::memory_order_relaxed);
  }
  source.held = held;
  source.received = steady;
  return counts;
}

bool DeadMan::heard(Duration steady) const {
  if (!held()) return true;
  return steady - Duration(received_ns_.load(std::memory_order_relaxed)) <= patience_;
}

}  // namespace exemplar::executor
