#pragma once

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace exemplar::learning {

/// Hands what was freed back to the system between the stages of learning: trials' streams lie
/// scattered, and what one stage freed the next could otherwise not use for its large blocks.
inline void ReturnFreedMemory() {
#if defined(__GLIBC__)
  malloc_trim(0);
#endif
}

}  // namespace exemplar::learning
