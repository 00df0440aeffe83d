#include "deviation.hpp"

#include <algorithm>

namespace exemplar::learning {
namespace {

Eigen::MatrixXd Positions(std::span<const geometry::Pose> poses, int max_points) {
  const auto count = static_cast<Eigen::Index>(poses.size());
  const Eigen::Index rows = std::min<Eigen::Index>(count, max_points);
  Eigen::MatrixXd positions(rows, 3);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::Index from = rows > 1 ? i * (count - 1) / (rows - 1) : count - 1;
    positions.row(i) = poses[static_cast<std::size_t>(from)].translation.transpose();
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
