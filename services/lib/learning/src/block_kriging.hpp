#pragma once
// Best linear prediction of vector-valued paths whose covariance is a sum of parts, with
// closed-form leave-one-trial-out errors.

#include <Eigen/Core>
#include <vector>

namespace exemplar::learning {

/// Covariance of n trials of 3-vectors, in units of the noise: P P^T + T (S x I) T^T, the same for
/// every frame but for a scale. What all trials share in a few directions is P; what depends on how
/// alike two situations are is S.
struct PartedCovariance {
  Eigen::MatrixXd parts;               ///< P, 3n x r
  Eigen::MatrixXd similarity;          ///< S, n x n; empty: none
  std::vector<Eigen::Matrix3d> turns;  ///< T's diagonal blocks, rotations; empty: none
};

/// Immutable. The inverse of few trials is kept whole; of many, that of the n x n similarity with
/// noise, corrected for the r parts (Woodbury): a 27th of the work and a 9th of the memory.
class BlockKriging {
 public:
  /// `covariance` without the noise, which is added here.
  explicit BlockKriging(const PartedCovariance& covariance);

  /// Inverse of the covariance with noise, times `values` (3n x m). The prediction is cross *
  /// these, where `cross` is the 3 x 3n covariance of the wanted trial with the others.
  Eigen::MatrixXd Duals(const Eigen::Ref<const Eigen::MatrixXd>& values) const;
  /// The inverse itself, 3n x 3n; empty where the trials are many.
  const Eigen::MatrixXd& inverse() const { return inverse_; }

  /// Value minus what the other trials predict (Rippa 1999, in blocks), times `share`, added to
  /// `errors` (3n x N). Returns the noise's variance at each frame (N), from these errors and what
  /// they should be.
  Eigen::VectorXd AddLeftOutErrors(const Eigen::MatrixXd& values, double share,
                                   Eigen::MatrixXd& errors) const;

  /// The deviation that a trial's left-out error should have, in units of the noise.
  double LeftOutSpread(Eigen::Index trial) const;

 private:
  Eigen::Matrix3d DiagonalBlock(Eigen::Index trial) const;

  Eigen::Index trials_ = 0;
  Eigen::MatrixXd inverse_;             // 3n x 3n; empty: of many trials
  Eigen::MatrixXd similarity_inverse_;  // n x n, of S + I; empty: of I
  std::vector<Eigen::Matrix3d> turns_;
  Eigen::MatrixXd correction_;  // 3n x r: what to take off is correction_ correction_^T
};

/// Choices between models are made on at most this many trials; answers use all.
inline constexpr int kMostForChoice = 40;
/// At most `most` of n, evenly.
std::vector<int> EvenChoice(int n, int most);
/// The chosen trials' rows of `values` (3n x N) at an even choice of frames with the first and the
/// last among them.
Eigen::MatrixXd FramesForChoice(const Eigen::MatrixXd& values, const std::vector<int>& chosen);

/// How bad left-out errors (3n x N) are: mean distance, half the mean of each trial's largest, and
/// the mean at the end. Paths are judged by their shape and by where they end.
double LeftOutScore(const Eigen::MatrixXd& errors);

}  // namespace exemplar::learning
