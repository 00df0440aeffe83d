#include "prediction.hpp"

namespace exemplar::learning {

void Bundle::Set(int trial, const Eigen::Ref<const Eigen::MatrixXd>& stream) {
  for (Eigen::Index i = 0; i < stream.rows(); ++i) {
    stacked_.col(trial).segment(i * channels_, channels_) = stream.row(i).transpose();
  }
}

RotationBundle::RotationBundle(const std::vector<std::vector<Eigen::Quaterniond>>& rotations) {
  if (rotations.empty()) return;
  const std::size_t frames = rotations[0].size();
  const std::size_t trials = rotations.size();
  vectors_ = Bundle(static_cast<int>(frames), 3, static_cast<int>(trials));
  std::vector<Eigen::MatrixXd> streams(trials,
                                       Eigen::MatrixXd(static_cast<Eigen::Index>(frames), 3));
  std::vector<Eigen::Quaterniond> at_frame(trials);
  for (std::size_t i = 0; i < frames; ++i) {
    for (std::size_t j = 0; j < trials; ++j) at_frame[j] = rotations[j][i];
    mean_.push_back(geometry::MeanRotation(at_frame));
    for (std::size_t j = 0; j < trials; ++j) {
      streams[j].row(static_cast<Eigen::Index>(i)) =
          geometry::LogSo3(mean_.back().conjugate() * rotations[j][i]).transpose();
    }
  }
  for (std::size_t j = 0; j < trials; ++j) vectors_.Set(static_cast<int>(j), streams[j]);
}

}  // namespace exemplar::learning
