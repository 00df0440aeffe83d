#pragma once
#include <sys/resource.h>
#include <unistd.h>

#include <future>
#include <thread>
#include <utility>

namespace exemplar::learning_service {

/// Runs `work` on a thread that gives way to those that answer queries. What it throws is thrown
/// here.
template <class Work>
auto RunBehindOthers(const Work& work) {
  std::packaged_task<decltype(work())()> task([&work] {
    // A niceness of this thread alone; where it is refused, it runs as the others do.
    constexpr int kNiceness = 10;
    static_cast<void>(setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNiceness));
    return work();
  });
  auto result = task.get_future();
  std::thread(std::move(task)).join();
  return result.get();
}

}  // namespace exemplar::learning_service
