#include "handler_pool.hpp"

#include <utility>

namespace exemplar::http {

HandlerPool::HandlerPool(std::size_t threads, std::size_t waiting)
    : most_threads_(threads), most_waiting_(waiting) {}

HandlerPool::~HandlerPool() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  there_is_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

bool HandlerPool::Run(std::function<void()> task) {
  const std::lock_guard lock(mutex_);
  if (ending_) return false;
  if (idle_ <= waiting_.size()) {
    if (threads_.size() < most_threads_) {
      threads_.emplace_back([this] { Work(); });
    } else if (waiting_.size() >= most_waiting_ + idle_) {
      return false;
    }
  }
  waiting_.push_back(std::move(task));
  there_is_.notify_one();
  return true;
}

void HandlerPool::Work() {
  std::unique_lock lock(mutex_);
  while (true) {
    ++idle_;
    there_is_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
    --idle_;
    if (waiting_.empty()) return;
    const std::function<void()> task = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    task();
    lock.lock();
  }
}

}  // namespace exemplar::http
