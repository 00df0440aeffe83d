#pragma once
// Objects in a stereo pair: markers in both pictures, triangulated, and the marked object's pose
// fitted to their corners.

#include <array>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/geometry/pose.hpp"
#include "exemplar/perception/markers.hpp"
#include "exemplar/perception/picture.hpp"
#include "exemplar/scene/description.hpp"

namespace exemplar::perception {

struct FinderOptions {
  /// Standard deviation of a corner's place in the picture that variances never go below.
  double corner_sigma_px = 0.05;
  /// Corners of the fitted marker farther than this (root mean square) from those seen: dropped.
  double largest_residual_px = 1.0;
  /// Rows of the same corner in the two pictures differ by more: not the same marker.
  double largest_row_difference_px = 3.0;
};

struct FoundObject {
  std::string name;
  geometry::Pose base_T_object;
  Eigen::Vector3d position_variance_m2 = Eigen::Vector3d::Zero();  ///< along base's axes
  double rotation_variance_rad2 = 0;                               ///< the largest of three axes
  double residual_px = 0;
};

/// What one pair gave.
struct Findings {
  std::vector<FoundObject> objects;
  int one_eyed = 0;     ///< known markers that only one picture showed
  int implausible = 0;  ///< seen by both, but no rigid marker in front of the camera fits
};

/// Finds the marked buttons and objects of a scene. Immutable, so thread-safe.
class ObjectFinder {
 public:
  static Result<ObjectFinder> Create(scene::StereoCamera camera,
                                     const std::vector<scene::Button>& buttons,
                                     FinderOptions options = {});
  static Result<ObjectFinder> Create(scene::StereoCamera camera, std::vector<scene::Marked> marked,
                                     FinderOptions options = {});

  /// Pictures of another size than the camera's are an error.
  Result<Findings> Find(const Picture& left, const Picture& right) const;
  /// The geometric half: from corners to poses.
  Findings FindFromCorners(const std::vector<DetectedMarker>& left,
                           const std::vector<DetectedMarker>& right) const;

  const scene::StereoCamera& camera() const { return camera_; }

 private:
  ObjectFinder(scene::StereoCamera camera, std::vector<scene::Marked> marked,
               FinderOptions options);

  scene::StereoCamera camera_;
  std::vector<scene::Marked> marked_;
  FinderOptions options_;
};

/// Where a point (left camera's optical frame, z > 0) appears: left x, left y, right x, right y, in
/// pixels with the centre of the first pixel at (0, 0).
Eigen::Vector4d Project(const scene::StereoCamera& camera, const Eigen::Vector3d& left_p);

}  // namespace exemplar::perception
