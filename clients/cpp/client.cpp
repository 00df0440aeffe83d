#include "exemplar/client.hpp"

namespace exemplar::client {

const char* Version() { return EXEMPLAR_VERSION; }

}  // namespace exemplar::client
