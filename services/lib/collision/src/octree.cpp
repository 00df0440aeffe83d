#include "octree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "exemplar/base/text.hpp"

namespace exemplar::collision {
namespace {

using Cell = std::array<std::int32_t, 3>;

/// Cells from the origin, along an axis: so many levels fold into the root.
constexpr double kMostCells = 1 << 20;

Cell ParentOf(const Cell& cell) { return {cell[0] >> 1, cell[1] >> 1, cell[2] >> 1}; }

Bounds BoundsOf(const Cell& cell, double edge_m) {
  const Eigen::Vector3d lower = edge_m * Eigen::Vector3d(cell[0], cell[1], cell[2]);
  return {lower, lower + Eigen::Vector3d::Constant(edge_m)};
}

}  // namespace

Result<std::vector<Bounds>> OctreeCells(std::span<const Eigen::Vector3d> points,
                                        double resolution_m) {
  if (!(resolution_m > 0) || !std::isfinite(resolution_m)) {
    return InvalidArgument("resolution is " + FormatDouble(resolution_m) + " m, must be positive");
  }
  std::vector<Cell> cells;
  cells.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Array3d scaled = (points[i].array() / resolution_m).floor();
    if (!points[i].allFinite() || (scaled.abs() >= kMostCells).any()) {
      return InvalidArgument("point " + std::to_string(i) + " is (" + FormatDouble(points[i].x()) +
                             ", " + FormatDouble(points[i].y()) + ", " +
                             FormatDouble(points[i].z()) + "), must be finite and within " +
                             FormatDouble(kMostCells * resolution_m) + " m");
    }
    cells.push_back({static_cast<std::int32_t>(scaled[0]), static_cast<std::int32_t>(scaled[1]),
                     static_cast<std::int32_t>(scaled[2])});
  }
  std::vector<Bounds> out;
  for (double edge_m = resolution_m; !cells.empty(); edge_m *= 2) {
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    std::sort(cells.begin(), cells.end(), [](const Cell& a, const Cell& b) {
      return std::pair(ParentOf(a), a) < std::pair(ParentOf(b), b);
    });
    std::vector<Cell> full;
    for (std::size_t i = 0; i < cells.size();) {
      const std::size_t begin = i;
      const Cell parent = ParentOf(cells[begin]);
      while (i < cells.size() && ParentOf(cells[i]) == parent) ++i;
      if (i - begin == 8) {
        full.push_back(parent);
        continue;
      }
      for (std::size_t k = begin; k < i; ++k) out.push_back(BoundsOf(cells[k], edge_m));
    }
    cells = std::move(full);
  }
  return out;
}

}  // namespace exemplar::collision
