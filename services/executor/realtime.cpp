#include "executor/realtime.hpp"

#include <pthread.h>
#include <sys/mman.h>
#include <sys/resource.h>

namespace exemplar::executor {

bool RaisePriority(int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
}

bool LockMemory() {
  // With a small limit, later allocations would fail: all or nothing.
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) != 0 || limit.rlim_cur != RLIM_INFINITY) return false;
  return mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
}

}  // namespace exemplar::executor
