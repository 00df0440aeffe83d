#pragma once
// Hands values from a loop that must not wait to a thread that may.

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

namespace exemplar::simulator {

/// Calls `deliver` for every value on a thread of its own, in order. Thread-safe, but for Finish.
/// The destructor finishes.
template <class Value>
class Outbox {
 public:
  /// Holds at most `capacity` values; what comes when it is full is dropped and counted.
  Outbox(std::size_t capacity, std::function<void(Value&&)> deliver)
      : capacity_(capacity),
        deliver_(std::move(deliver)),
        thread_([this](std::stop_token stop) { Run(stop); }) {}

  bool Put(Value value) {
    {
      const std::lock_guard lock(mutex_);
      if (waiting_.size() >= capacity_) {
        ++dropped_;
        return false;
      }
      waiting_.push_back(std::move(value));
    }
    changed_.notify_all();
    return true;
  }

  /// Returns when what was put so far has been delivered.
  void Flush() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return waiting_.empty() && !delivering_; });
  }

  /// Delivers what is left and ends the thread; what is put afterwards stays.
  void Finish() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }

  std::uint64_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  void Run(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, stop, [this] { return !waiting_.empty(); });
      if (waiting_.empty()) return;
      Value value = std::move(waiting_.front());
      waiting_.pop_front();
      delivering_ = true;
      lock.unlock();
      deliver_(std::move(value));
      lock.lock();
      delivering_ = false;
      if (waiting_.empty()) changed_.notify_all();
    }
  }

  const std::size_t capacity_;
  const std::function<void(Value&&)> deliver_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Value> waiting_;
  bool delivering_ = false;
  std::uint64_t dropped_ = 0;
  std::jthread thread_;  ///< last: stops before the rest goes
};

}  // namespace exemplar::simulator
