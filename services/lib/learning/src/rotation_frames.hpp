#pragma once
// Tool orientations in the frame, the world's or the target's, that predicts left-out trials best.
// Chosen apart from the positions' frames: a button is pressed downward wherever it is turned.

#include <Eigen/Core>
#include <vector>

#include "block_kriging.hpp"
#include "exemplars.hpp"
#include "path_frames.hpp"
#include "weighted_sum.hpp"

namespace exemplar::learning {

class RotationFrames {
 public:
  /// `path`: the positions' model of the same exemplars. Precondition: exemplars.has_tool.
  RotationFrames(const Exemplars& exemplars, const PathFrames& path);

  /// One a frame (x y z w), base frame. Begins at the situation's start orientation where that is
  /// given.
  Eigen::MatrixX4d Predict(const Situation& situation, const FrameSituation& where) const;
  bool turns_with_object() const { return with_object_; }
  /// The trials never turned the object: which frame the orientation keeps to is assumed.
  bool assumed() const { return assumed_; }

 private:
  struct Candidate;
  /// The covariance of two trials is kStartGain start_a start_b^T and kConstantGain and this on the
  /// diagonal.
  double Similarity(const FrameSituation& a, const FrameSituation& b, double residual) const;
  PartedCovariance Parted(const std::vector<int>& chosen,
                          const Eigen::Ref<const Eigen::VectorXd>& first, double residual) const;
  /// Sets mean_, and returns the trials' rotation vectors from it, 3n x frames.
  Eigen::MatrixXd RotationVectors(const Exemplars& exemplars, bool with_object);

  bool with_object_ = false;
  bool assumed_ = false;
  int target_ = -1;
  double length_m_ = 1;
  double residual_ = 0;
  Eigen::MatrixX4d mean_;  // in the chosen frame, one a frame
  std::vector<FrameSituation> situations_;
  // Inverse covariance times rotation vectors, x y z of all frames a column: of each trial, or of
  // their sum where all trials count the same.
  Streams duals_;
  Eigen::VectorXd of_start_;  // frames: how far the vectors go with the start's
  Eigen::VectorXd start_share_;
};

}  // namespace exemplar::learning
