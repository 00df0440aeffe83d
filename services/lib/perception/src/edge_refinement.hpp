#pragma once
// Corners of a marker to hundredths of a pixel: lines through its four edges, intersected. A line
// rests on dozens of pixels where a corner rests on a few.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

namespace exemplar::perception {

/// A grey picture somebody else holds; rows from the top, no padding.
struct GreyView {
  int width = 0;
  int height = 0;
  std::span<const std::uint8_t> pixels;

  /// Bilinear, the centre of the first pixel at (0, 0), clamped at the rim.
  double At(const Eigen::Vector2d& px) const;
};

/// Moves `corners_px`, right to about a pixel, onto the intersections of the edges between the
/// marker's black border and the light zone around it, both `1 / cells` of an edge wide. False, and
/// unchanged, where the picture shows no such edges.
bool RefineCorners(const GreyView& picture, int cells, std::array<Eigen::Vector2d, 4>& corners_px);

}  // namespace exemplar::perception
