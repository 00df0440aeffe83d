#pragma once
// Threads on which handlers run.

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace exemplar::http {

/// Starts threads as they are needed, up to `threads`; `waiting` tasks may wait for one.
/// Thread-safe. The destructor runs what waits and joins.
class HandlerPool {
 public:
  HandlerPool(std::size_t threads, std::size_t waiting);
  ~HandlerPool();
  HandlerPool(const HandlerPool&) = delete;
  HandlerPool& operator=(const HandlerPool&) = delete;

  /// False when there is no room.
  bool Run(std::function<void()> task);

 private:
  void Work();

  const std::size_t most_threads_;
  const std::size_t most_waiting_;
  std::mutex mutex_;
  std::condition_variable there_is_;
  std::deque<std::function<void()>> waiting_;
  std::size_t idle_ = 0;
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace exemplar::http
