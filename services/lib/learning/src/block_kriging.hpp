#pragma once
// Best linear prediction of vector-valued paths whose covariance is a sum of parts, with
// closed-form leave-one-trial-out errors.

#include <Eigen/Core>
#include <vector>

namespace exemplar::learning {

/// n trials with 3-vectors at N frames; the covariance between two trials is a 3 x 3 block, the
/// same for every frame but for a scale. Immutable.
class BlockKriging {
 public:
  /// `covariance`: 3n x 3n between the trials, in units of the noise, which is added here.
  /// `values`: 3n x N.
  BlockKriging(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& values);

  /// Value minus what the other trials predict: 3n x N. Rippa 1999, in blocks.
  const Eigen::MatrixXd& left_out_errors() const { return errors_; }
  /// Variance of the noise at each frame (N), from the left-out errors and what they should be.
  const Eigen::VectorXd& noise_variance() const { return noise_; }
  /// 3n x 3n: the prediction is cross * inverse * values, where `cross` is the 3 x 3n covariance of
  /// the wanted trial with the others.
  const Eigen::MatrixXd& inverse() const { return inverse_; }
  /// inverse * values: 3n x N.
  Eigen::MatrixXd Duals(const Eigen::MatrixXd& values) const { return inverse_ * values; }

 private:
  Eigen::MatrixXd inverse_;
  Eigen::MatrixXd errors_;
  Eigen::VectorXd noise_;
};

/// How bad left-out errors (3n x N) are: mean distance, half the mean of each trial's largest, and
/// the mean at the end. Paths are judged by their shape and by where they end.
double LeftOutScore(const Eigen::MatrixXd& errors);

}  // namespace exemplar::learning
