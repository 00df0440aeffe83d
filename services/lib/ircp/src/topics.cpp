#include <string>

#include "exemplar/ircp/samples.hpp"

namespace exemplar::ircp {

std::string CommandTopic(std::string_view program) {
  return "ircp/" + std::string(program) + "/command";
}

std::string StatusTopic(std::string_view program) {
  return "ircp/" + std::string(program) + "/status";
}

}  // namespace exemplar::ircp
