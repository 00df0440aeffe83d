#pragma once
// Pictures of a marker as an ideal camera would take them, drawn here so that the tests know the
// truth exactly.

#include <Eigen/Core>
#include <cmath>

#include "exemplar/base/rng.hpp"
#include "exemplar/perception/markers.hpp"
#include "exemplar/perception/object_finder.hpp"

namespace exemplar::perception {

/// What one eye of `camera` sees of a marker on white paper with a quiet zone of one cell, before
/// grey. Every pixel is the mean of `samples` x `samples` rays.
inline Picture DrawMarker(const scene::StereoCamera& camera, bool right,
                          const geometry::Pose& left_T_marker, int id, double size_m,
                          int samples = 6) {
  const MarkerCells cells = *MarkerPattern(id);
  const geometry::Pose marker_T_left = left_T_marker.Inverse();
  const Eigen::Vector3d eye =
      marker_T_left * Eigen::Vector3d(right ? camera.baseline_m : 0.0, 0, 0);
  const double f = camera.focal_px();
  Picture picture{camera.width, camera.height, {}};
  picture.rgb.reserve(3 * static_cast<std::size_t>(camera.width * camera.height));
  const double cell = size_m / kMarkerCells;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      double sum = 0;
      for (int k = 0; k < samples * samples; ++k) {
        const double x = column + (k % samples + 0.5) / samples - 0.5;
        const double y = row + (k / samples + 0.5) / samples - 0.5;
        const Eigen::Vector3d ray =
            marker_T_left.rotation * Eigen::Vector3d((x - 0.5 * (camera.width - 1)) / f,
                                                     (y - 0.5 * (camera.height - 1)) / f, 1);
        const double way = -eye.z() / ray.z();
        const Eigen::Vector3d hit = eye + way * ray;
        const int c = static_cast<int>(std::floor(hit.x() / cell + 0.5 * kMarkerCells));
        const int r = static_cast<int>(std::floor(-hit.y() / cell + 0.5 * kMarkerCells));
        if (way <= 0 || c < -1 || r < -1 || c > kMarkerCells || r > kMarkerCells) {
          sum += 130;
        } else if (c < 0 || r < 0 || c == kMarkerCells || r == kMarkerCells) {
          sum += 235;
        } else {
          sum += cells[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] ? 235 : 20;
        }
      }
      const auto grey = static_cast<std::uint8_t>(std::lround(sum / (samples * samples)));
      picture.rgb.insert(picture.rgb.end(), 3, grey);
    }
  }
  return picture;
}

/// Before the camera, its face turned to it but for up to `tilt_rad` about a random axis and any
/// turn in its plane; within the middle half of both pictures.
inline geometry::Pose RandomMarkerPose(Rng& rng, double tilt_rad) {
  geometry::Pose left_T_marker;
  left_T_marker.translation = {rng.Uniform(-0.08, 0.16), rng.Uniform(-0.1, 0.1),
                               rng.Uniform(0.7, 1.0)};
  const double direction = rng.Uniform(0, 6.283);
  const Eigen::Vector3d axis(std::cos(direction), std::sin(direction), 0);
  // z out of the face: towards the camera.
  left_T_marker.rotation = geometry::ExpSo3(rng.Uniform(0, tilt_rad) * axis) *
                           Eigen::Quaterniond(0, 1, 0, 0) *
                           geometry::ExpSo3({0, 0, rng.Uniform(-3.1, 3.1)});
  return left_T_marker;
}

inline scene::StereoCamera TestCamera() {
  scene::StereoCamera camera;
  camera.name = "stereo";
  camera.width = 320;
  camera.height = 240;
  camera.fovy_rad = 0.7;
  camera.baseline_m = 0.1;
  camera.base_T_left.translation = {0.5, -0.1, 1};
  camera.base_T_left.rotation = Eigen::Quaterniond(0, 1, 0, 0) * geometry::ExpSo3({0.2, 0.1, 0.7});
  return camera;
}

inline DetectedMarker CornersSeen(const scene::StereoCamera& camera, bool right,
                                  const geometry::Pose& left_T_marker, int id, double size_m) {
  DetectedMarker seen;
  seen.id = id;
  const std::array<Eigen::Vector3d, 4> corners = MarkerCorners(size_m);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector4d px = Project(camera, left_T_marker * corners[i]);
    seen.corners_px[i] = right ? px.tail<2>() : px.head<2>();
  }
  return seen;
}

}  // namespace exemplar::perception
