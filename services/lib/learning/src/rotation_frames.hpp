#pragma once
// Tool orientations in the frame, the world's or the target's, that predicts left-out trials best.
// Chosen apart from the positions' frames: a button is pressed downward wherever it is turned.

#include <Eigen/Core>
#include <vector>

#include "block_kriging.hpp"
#include "exemplars.hpp"
#include "path_frames.hpp"

namespace exemplar::learning {

class RotationFrames {
 public:
  /// `path`: the positions' model of the same exemplars. Precondition: exemplars.has_tool.
  RotationFrames(const Exemplars& exemplars, const PathFrames& path);

  /// One a frame, base frame. Begins at the situation's start orientation where that is given.
  std::vector<Eigen::Quaterniond> Predict(const Situation& situation,
                                          const FrameSituation& where) const;
  bool turns_with_object() const { return with_object_; }
  /// The trials never turned the object: which frame the orientation keeps to is assumed.
  bool assumed() const { return assumed_; }

 private:
  struct Fitted;
  Eigen::Matrix3d Covariance(const Eigen::Vector3d& start_a, const FrameSituation& a,
                             const Eigen::Vector3d& start_b, const FrameSituation& b,
                             double residual) const;

  bool with_object_ = false;
  bool assumed_ = false;
  int target_ = -1;
  double length_m_ = 1;
  double residual_ = 0;
  std::vector<Eigen::Quaterniond> mean_;  // in the chosen frame, one a frame
  Eigen::VectorXd first_;                 // 3n: rotation vectors from the mean at the first frame
  std::vector<FrameSituation> situations_;
  Eigen::MatrixXd duals_;  // 3n x frames: inverse covariance times rotation vectors
  Eigen::VectorXd start_share_;
};

}  // namespace exemplar::learning
