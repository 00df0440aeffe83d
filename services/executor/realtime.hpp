#pragma once
// What the operating system can do for a loop that must not be late.

namespace exemplar::executor {

/// Puts the calling thread before all ordinary ones (SCHED_FIFO at `priority`, 1 to 99). False
/// where this is not permitted; then nothing has changed.
bool RaisePriority(int priority);

/// Keeps the program's memory in RAM. False where this is not permitted.
bool LockMemory();

}  // namespace exemplar::executor
