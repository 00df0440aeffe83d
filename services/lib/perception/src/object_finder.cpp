#include "exemplar/perception/object_finder.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

namespace exemplar::perception {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Corners = std::array<Eigen::Vector3d, 4>;

Eigen::Vector2d PrincipalPoint(const scene::StereoCamera& camera) {
  return {0.5 * (camera.width - 1), 0.5 * (camera.height - 1)};
}

/// The point that both pictures show, in the left optical frame; nothing without disparity.
std::optional<Eigen::Vector3d> Triangulate(const scene::StereoCamera& camera,
                                           const Eigen::Vector2d& left_px,
                                           const Eigen::Vector2d& right_px) {
  const double disparity = left_px.x() - right_px.x();
  if (disparity < 0.5) return std::nullopt;
  const double z = camera.focal_px() * camera.baseline_m / disparity;
  const Eigen::Vector2d centre = PrincipalPoint(camera);
  const double y_px = 0.5 * (left_px.y() + right_px.y());
  return Eigen::Vector3d((left_px.x() - centre.x()) * z / camera.focal_px(),
                         (y_px - centre.y()) * z / camera.focal_px(), z);
}

struct Fit {
  geometry::Pose left_T_marker;
  Matrix6d information = Matrix6d::Zero();  ///< of (translation, rotation vector), unit pixels
  double residual_px = 0;                   ///< root mean square over 16 coordinates
};

/// Sum of squares, gradient and curvature of the reprojection error under left-multiplied
/// rotations; nothing when a corner is behind the camera.
struct Normal {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double sum_of_squares = 0;
};

std::optional<Normal> Linearise(const scene::StereoCamera& camera, const Corners& marker_corners,
                                const DetectedMarker& left, const DetectedMarker& right,
                                const geometry::Pose& left_T_marker) {
  Normal normal;
  const double f = camera.focal_px();
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d arm = left_T_marker.rotation * marker_corners[i];
    const Eigen::Vector3d p = left_T_marker.translation + arm;
    if (p.z() < 1e-3) return std::nullopt;
    Eigen::Vector4d seen;
    seen << left.corners_px[i], right.corners_px[i];
    const Eigen::Vector4d error = Project(camera, p) - seen;
    Eigen::Matrix<double, 4, 3> by_point;
    by_point << f / p.z(), 0, -f * p.x() / (p.z() * p.z()),                //
        0, f / p.z(), -f * p.y() / (p.z() * p.z()),                        //
        f / p.z(), 0, -f * (p.x() - camera.baseline_m) / (p.z() * p.z()),  //
        0, f / p.z(), -f * p.y() / (p.z() * p.z());
    Eigen::Matrix3d arm_cross;
    arm_cross << 0, -arm.z(), arm.y(), arm.z(), 0, -arm.x(), -arm.y(), arm.x(), 0;
    Eigen::Matrix<double, 4, 6> jacobian;
    jacobian.leftCols<3>() = by_point;
    jacobian.rightCols<3>() = -by_point * arm_cross;
    normal.hessian += jacobian.transpose() * jacobian;
    normal.gradient += jacobian.transpose() * error;
    normal.sum_of_squares += error.squaredNorm();
  }
  return normal;
}

/// The pose whose corners project nearest to those seen: rigid fit of the triangulated corners
/// (Umeyama 1991), then Gauss-Newton on the pixels of both pictures.
std::optional<Fit> FitMarker(const scene::StereoCamera& camera, const scene::Marker& marker,
                             const DetectedMarker& left, const DetectedMarker& right) {
  const Corners corners = MarkerCorners(marker.size_m);
  Eigen::Matrix<double, 3, 4> seen;
  Eigen::Matrix<double, 3, 4> known;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::optional<Eigen::Vector3d> point =
        Triangulate(camera, left.corners_px[i], right.corners_px[i]);
    if (!point) return std::nullopt;
    seen.col(static_cast<Eigen::Index>(i)) = *point;
    known.col(static_cast<Eigen::Index>(i)) = corners[i];
  }
  Fit fit;
  fit.left_T_marker = geometry::Pose::FromIsometry(
      Eigen::Isometry3d(Eigen::umeyama(known, seen, /*with_scaling=*/false)));

  constexpr int kIterations = 20;
  std::optional<Normal> normal;
  for (int i = 0; i < kIterations; ++i) {
    normal = Linearise(camera, corners, left, right, fit.left_T_marker);
    if (!normal) return std::nullopt;
    const Eigen::LDLT<Matrix6d> solver(normal->hessian);
    if (solver.info() != Eigen::Success || !solver.isPositive()) return std::nullopt;
    const Vector6d step = -solver.solve(normal->gradient);
    if (!step.allFinite()) return std::nullopt;
    fit.left_T_marker.translation += step.head<3>();
    fit.left_T_marker.rotation =
        (geometry::ExpSo3(step.tail<3>()) * fit.left_T_marker.rotation).normalized();
    if (step.norm() < 1e-10) break;
  }
  normal = Linearise(camera, corners, left, right, fit.left_T_marker);
  if (!normal) return std::nullopt;
  fit.information = normal->hessian;
  fit.residual_px = std::sqrt(normal->sum_of_squares / 16);
  return fit;
}

const DetectedMarker* Find(const std::vector<DetectedMarker>& markers, int id) {
  const auto it = std::find_if(markers.begin(), markers.end(),
                               [id](const DetectedMarker& m) { return m.id == id; });
  return it == markers.end() ? nullptr : &*it;
}

double LargestRowDifference(const DetectedMarker& left, const DetectedMarker& right) {
  double largest = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    largest = std::max(largest, std::abs(left.corners_px[i].y() - right.corners_px[i].y()));
  }
  return largest;
}

}  // namespace

Eigen::Vector4d Project(const scene::StereoCamera& camera, const Eigen::Vector3d& left_p) {
  const Eigen::Vector2d centre = PrincipalPoint(camera);
  const double f = camera.focal_px();
  const double y = centre.y() + f * left_p.y() / left_p.z();
  return {centre.x() + f * left_p.x() / left_p.z(), y,
          centre.x() + f * (left_p.x() - camera.baseline_m) / left_p.z(), y};
}

ObjectFinder::ObjectFinder(scene::StereoCamera camera, std::vector<scene::Marked> marked,
                           FinderOptions options)
    : camera_(std::move(camera)), marked_(std::move(marked)), options_(options) {}

Result<ObjectFinder> ObjectFinder::Create(scene::StereoCamera camera,
                                          const std::vector<scene::Button>& buttons,
                                          FinderOptions options) {
  scene::Description scene;
  scene.buttons = buttons;
  return Create(std::move(camera), scene::MarkedThings(scene), options);
}

Result<ObjectFinder> ObjectFinder::Create(scene::StereoCamera camera,
                                          std::vector<scene::Marked> marked,
                                          FinderOptions options) {
  std::set<int> ids;
  for (const scene::Marked& thing : marked) {
    if (ids.insert(thing.marker.id).second) continue;
    return InvalidArgument("marker id " + std::to_string(thing.marker.id) + " of \"" + thing.name +
                               "\" is on another object too",
                           "buttons");
  }
  if (marked.empty()) {
    return InvalidArgument("no button of the scene has a marker: there is nothing to find",
                           "buttons");
  }
  return ObjectFinder(std::move(camera), std::move(marked), options);
}

Result<Findings> ObjectFinder::Find(const Picture& left, const Picture& right) const {
  for (const Picture* picture : {&left, &right}) {
    if (picture->width != camera_.width || picture->height != camera_.height) {
      return InvalidArgument("picture is " + std::to_string(picture->width) + " x " +
                                 std::to_string(picture->height) + ", camera \"" + camera_.name +
                                 "\" has " + std::to_string(camera_.width) + " x " +
                                 std::to_string(camera_.height),
                             picture == &left ? "left" : "right");
    }
  }
  return FindFromCorners(DetectMarkers(left), DetectMarkers(right));
}

Findings ObjectFinder::FindFromCorners(const std::vector<DetectedMarker>& left,
                                       const std::vector<DetectedMarker>& right) const {
  Findings findings;
  for (const scene::Marked& marked : marked_) {
    const DetectedMarker* in_left = perception::Find(left, marked.marker.id);
    const DetectedMarker* in_right = perception::Find(right, marked.marker.id);
    if (in_left == nullptr && in_right == nullptr) continue;
    if (in_left == nullptr || in_right == nullptr) {
      ++findings.one_eyed;
      continue;
    }
    std::optional<Fit> fit;
    if (LargestRowDifference(*in_left, *in_right) <= options_.largest_row_difference_px) {
      fit = FitMarker(camera_, marked.marker, *in_left, *in_right);
    }
    if (!fit || fit->residual_px > options_.largest_residual_px) {
      ++findings.implausible;
      continue;
    }
    FoundObject object;
    object.name = marked.name;
    object.residual_px = fit->residual_px;
    const geometry::Pose marker_T_object = marked.marker.object_T_marker.Inverse();
    object.base_T_object = camera_.base_T_left * fit->left_T_marker * marker_T_object;

    // 16 coordinates, 6 of them spent on the pose.
    const double sigma_px =
        std::max(options_.corner_sigma_px, fit->residual_px * std::sqrt(16.0 / 10.0));
    const Matrix6d covariance = sigma_px * sigma_px * fit->information.inverse();
    // The object's origin moves with the marker and turns about it.
    const Eigen::Vector3d arm = fit->left_T_marker.rotation * marker_T_object.translation;
    Eigen::Matrix<double, 3, 6> by_pose = Eigen::Matrix<double, 3, 6>::Zero();
    by_pose.leftCols<3>().setIdentity();
    by_pose.rightCols<3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
    const Eigen::Matrix3d base_R_left = camera_.base_T_left.rotation.toRotationMatrix();
    const Eigen::Matrix<double, 3, 6> in_base = base_R_left * by_pose;
    object.position_variance_m2 = (in_base * covariance * in_base.transpose()).diagonal();
    const Eigen::Matrix3d turn = covariance.bottomRightCorner<3, 3>();
    object.rotation_variance_rad2 =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(turn, Eigen::EigenvaluesOnly)
            .eigenvalues()
            .maxCoeff();
    findings.objects.push_back(std::move(object));
  }
  return findings;
}

}  // namespace exemplar::perception
