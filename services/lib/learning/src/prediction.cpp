#include "prediction.hpp"

#include "rotations.hpp"

namespace exemplar::learning {

RotationBundle::RotationBundle(const std::vector<std::vector<Eigen::Quaterniond>>& rotations) {
  if (rotations.empty()) return;
  const std::size_t frames = rotations[0].size();
  const std::size_t trials = rotations.size();
  const auto rows = static_cast<Eigen::Index>(frames);
  Eigen::MatrixXd vectors(3 * rows, static_cast<Eigen::Index>(trials));
  std::vector<Eigen::Quaterniond> mean;
  std::vector<Eigen::Quaterniond> at_frame(trials);
  for (std::size_t i = 0; i < frames; ++i) {
    for (std::size_t j = 0; j < trials; ++j) at_frame[j] = rotations[j][i];
    mean.push_back(geometry::MeanRotation(at_frame));
    for (std::size_t j = 0; j < trials; ++j) {
      const Eigen::Vector3d vector = geometry::LogSo3(mean.back().conjugate() * at_frame[j]);
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        vectors(axis * rows + static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            vector[axis];
      }
    }
  }
  mean_ = FromQuaternions(mean);
  vectors_ = Streams(vectors);
}

Eigen::MatrixX4d RotationBundle::Sum(const Eigen::Ref<const Eigen::VectorXd>& weights) const {
  const Eigen::VectorXd sum = vectors_.Sum(weights);
  return Turned(Eigen::Quaterniond::Identity(), mean_,
                Eigen::Map<const Eigen::MatrixX3d>(sum.data(), mean_.rows(), 3));
}

}  // namespace exemplar::learning
