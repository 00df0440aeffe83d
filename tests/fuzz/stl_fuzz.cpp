// Any bytes go through the STL reader, and what it takes through the making of hulls and closed
// surfaces. What is read is whole triangles of finite corners; a hull contains them all.

#include <cstdlib>
#include <string_view>

#include "convex_shape.hpp"
#include "mesh_file.hpp"
#include "solid_mesh.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace exemplar::collision;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto corners = ParseStl(bytes, "fuzz.stl");
  if (!corners.ok()) return 0;
  if (corners->empty() || corners->size() % 3 != 0) std::abort();
  double largest = 0;
  for (const Eigen::Vector3d& corner : *corners) {
    if (!corner.allFinite()) std::abort();
    largest = std::max(largest, corner.cwiseAbs().maxCoeff());
  }
  if (largest > 1e6 || largest < 1e-6) return 0;  // no robot is of such size
  const auto hull = ConvexShape::OfPoints(*corners);
  if (hull.ok()) {
    const Bounds bounds = hull->BoundsAt({});
    for (const Eigen::Vector3d& corner : *corners) {
      if ((corner.array() > bounds.upper.array() + 1e-6 * largest).any()) std::abort();
      if ((corner.array() < bounds.lower.array() - 1e-6 * largest).any()) std::abort();
    }
  }
  const auto solid = MakeSolidMesh(*corners);
  if (!solid.ok()) return 0;
  if (solid->triangles.empty() || solid->shell_points.empty()) std::abort();
  const auto pieces = Pieces::OfMesh(solid->triangles, solid->shell_points);
  (void)pieces->Encloses(solid->shell_points.front());
  return 0;
}
