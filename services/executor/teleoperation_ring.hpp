#pragma once
#include <array>
#include <atomic>
#include <cstdint>

namespace exemplar::executor {

/// From one thread to another: neither waits or allocates. What a full one is given is dropped.
template <class Item, std::uint32_t kCapacity>
class HandOver {
 public:
  bool Put(const Item& item) {
    const std::uint32_t at = put_.load(std::memory_order_relaxed);
    if (at - taken_.load(std::memory_order_acquire) >= kCapacity) return false;
    items_[at % kCapacity] = item;
    put_.store(at + 1, std::memory_order_release);
    return true;
  }
  bool Get(Item& item) {
    const std::uint32_t at = taken_.load(std::memory_order_relaxed);
    if (at == put_.load(std::memory_order_acquire)) return false;
    item = items_[at % kCapacity];
    taken_.store(at + 1, std::memory_order_release);
    return true;
  }

 private:
  static_assert((kCapacity & (kCapacity - 1)) == 0, "counts wrap around");
  std::array<Item, kCapacity> items_{};
  std::atomic<std::uint32_t> put_{0};
  std::atomic<std::uint32_t> taken_{0};
};

}  // namespace exemplar::executor
