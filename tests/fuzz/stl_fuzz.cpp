// Any bytes go through the STL reader. What it takes is whole triangles of finite corners.

#include <cstdlib>
#include <string_view>

#include "mesh_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto corners = exemplar::collision::ParseStl(bytes, "fuzz.stl");
  if (!corners.ok()) return 0;
  if (corners->empty() || corners->size() % 3 != 0) std::abort();
  for (const Eigen::Vector3d& corner : *corners) {
    if (!corner.allFinite()) std::abort();
  }
  return 0;
}
