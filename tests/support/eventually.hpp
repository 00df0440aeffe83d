#pragma once
#include <chrono>
#include <thread>

namespace exemplar::testing {

/// True as soon as `condition` holds; false when it did not within `limit`. For what happens on
/// other threads without a signal of its own.
template <class Condition>
bool Eventually(Condition condition, std::chrono::seconds limit = std::chrono::seconds(20)) {
  const auto deadline = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace exemplar::testing
