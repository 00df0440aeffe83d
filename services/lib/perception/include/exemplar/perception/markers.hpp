#pragma once
// Square fiducial markers (ArUco, dictionary of 50 with 4 x 4 bits): their pattern, and where they
// are in a picture.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/perception/picture.hpp"

namespace exemplar::perception {

inline constexpr int kMarkerIds = 50;
inline constexpr int kMarkerCells = 6;  ///< along an edge, the black border included

/// cells[row][column], rows from the top; true is white.
using MarkerCells = std::array<std::array<bool, kMarkerCells>, kMarkerCells>;

/// kInvalidArgument unless 0 <= id < kMarkerIds.
Result<MarkerCells> MarkerPattern(int id);

/// A marker in a picture. Corners of the black square in pixels (the centre of the first pixel is
/// (0, 0), x right, y down): top left, top right, bottom right, bottom left of the upright marker.
struct DetectedMarker {
  int id = 0;
  std::array<Eigen::Vector2d, 4> corners_px;
};

/// Corners are refined to fractions of a pixel; markers that touch the picture's edge are left out.
/// An id that is seen twice is left out too: nobody can tell which one is meant.
std::vector<DetectedMarker> DetectMarkers(const Picture& picture);

/// The corners, in the order of DetectedMarker, in the marker's frame: origin in the middle, x
/// right, y up, z out of the printed face. Metres.
std::array<Eigen::Vector3d, 4> MarkerCorners(double size_m);

}  // namespace exemplar::perception
