#pragma once
// Threads for what a client asks for and may take long.

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

namespace exemplar::gateway::foxglove {

/// Thread-safe. The destructor asks what runs to stop, throws away what waits, and joins.
class Workers {
 public:
  Workers(std::size_t threads, std::size_t waiting);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// False when too much waits already.
  bool Run(std::function<void(std::stop_token)> task);

 private:
  void Work(const std::stop_token& stop);

  const std::size_t most_waiting_;
  std::mutex mutex_;
  std::condition_variable_any there_is_;
  std::deque<std::function<void(std::stop_token)>> waiting_;
  std::vector<std::jthread> threads_;
};

}  // namespace exemplar::gateway::foxglove
