#pragma once

namespace exemplar::executor::test {

/// Counts what the calling thread allocates (operator new and Eigen too) while it lives. The test's
/// binary must export its symbols, so that libraries' calls are counted as well.
class AllocationCount {
 public:
  AllocationCount();
  ~AllocationCount();
  int count() const;
  /// False where a sanitizer owns malloc.
  static bool Works();
};

}  // namespace exemplar::executor::test
