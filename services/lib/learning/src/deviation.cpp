#include "deviation.hpp"

#include <algorithm>

namespace exemplar::learning {
namespace {

// `count` positions at even parts of the samples.
Eigen::MatrixXd Positions(std::span<const geometry::Pose> poses, std::size_t count) {
  Eigen::MatrixXd positions(static_cast<Eigen::Index>(count), 3);
  const auto last = static_cast<double>(poses.size() - 1);
  for (std::size_t i = 0; i < count; ++i) {
    const double at =
        count > 1 ? last * static_cast<double>(i) / static_cast<double>(count - 1) : last;
    const auto k = std::min(static_cast<std::size_t>(at), poses.size() - 1);
    Eigen::Vector3d position = poses[k].translation;
    if (k + 1 < poses.size()) {
      position += (at - static_cast<double>(k)) * (poses[k + 1].translation - position);
    }
    positions.row(static_cast<Eigen::Index>(i)) = position.transpose();
  }
  return positions;
}

}  // namespace

demonstration::Deviation Compare(std::span<const geometry::Pose> answer,
                                 std::span<const geometry::Pose> shown, int max_points) {
  demonstration::Deviation deviation;
  deviation.frechet_m =
      demonstration::FrechetDistance(Positions(answer, max_points), Positions(shown, max_points));
  deviation.end_error_m = (answer.back().translation - shown.back().translation).norm();
  deviation.end_angle_rad = geometry::AngleBetween(answer.back().rotation, shown.back().rotation);
  return deviation;
}

}  // namespace exemplar::learning
