#include "gateway/foxglove/workers.hpp"

#include <utility>

namespace exemplar::gateway::foxglove {

Workers::Workers(std::size_t threads, std::size_t waiting) : most_waiting_(waiting) {
  for (std::size_t i = 0; i < threads; ++i) {
    threads_.emplace_back([this](const std::stop_token& stop) { Work(stop); });
  }
}

Workers::~Workers() {
  for (std::jthread& thread : threads_) thread.request_stop();
}

bool Workers::Run(std::function<void(std::stop_token)> task) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= most_waiting_) return false;
    waiting_.push_back(std::move(task));
  }
  there_is_.notify_one();
  return true;
}

void Workers::Work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (there_is_.wait(lock, stop, [this] { return !waiting_.empty(); })) {
    if (stop.stop_requested()) return;
    const std::function<void(std::stop_token)> task = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    task(stop);
    lock.lock();
  }
}

}  // namespace exemplar::gateway::foxglove
