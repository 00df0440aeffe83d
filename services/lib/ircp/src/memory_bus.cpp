#include "exemplar/ircp/memory_bus.hpp"

namespace exemplar::ircp {

template class BusOf<MemoryBus>;

}  // namespace exemplar::ircp
