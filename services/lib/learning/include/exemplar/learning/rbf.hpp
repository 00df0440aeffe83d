#pragma once
// Radial basis functions in cardinal form: PAPER.md section 5.2, Eq. 5.

#include <Eigen/Core>
#include <Eigen/LU>
#include <vector>

namespace exemplar::learning {

/// What is added to the radial part.
enum class Trend {
  kConstant,  ///< ordinary kriging; defined for any positions
  kAffine,    ///< the paper's, over the plane, line or point that the positions span
};

struct RbfOptions {
  Trend trend = Trend::kAffine;
  /// Added to the diagonal as measurement noise, as a part of the mean distance between positions:
  /// 0 interpolates.
  double ridge = 0;
};

/// The biharmonic spline R(x, x_i) = |x - x_i| with a trend over n positions of d coordinates.
/// Positions that coincide are averaged, coplanar, collinear and single ones take the trend of what
/// they span: there is always an answer. Immutable, so thread-safe.
class CardinalRbf {
 public:
  /// Precondition: positions has at least one row (n x d), all finite.
  CardinalRbf(const Eigen::Ref<const Eigen::MatrixXd>& positions, const RbfOptions& options);

  int size() const { return static_cast<int>(group_of_.size()); }
  /// Dimensions that the positions span and the affine trend covers.
  int rank() const { return static_cast<int>(basis_.cols()); }

  /// The weight of each trial at `position`; they sum to 1. The value there is sum_j w_j f_j.
  Eigen::VectorXd Weights(const Eigen::Ref<const Eigen::VectorXd>& position) const;

  /// The same function by its coefficients: value(p) = sum_g lambda_g |p - p_g| + c_0 + c . p.
  struct Coefficients {
    Eigen::VectorXd lambda;  ///< one a distinct position
    Eigen::VectorXd c;       ///< 1 + d
  };
  Coefficients Solve(const Eigen::Ref<const Eigen::VectorXd>& values) const;

  /// Value minus what the others predict, for each trial (rows of `values` are trials), in closed
  /// form (Rippa 1999; for repeated positions against the mean of the others there).
  Eigen::MatrixXd LeaveOneOut(const Eigen::Ref<const Eigen::MatrixXd>& values) const;

  /// The weights of the other trials in what they predict at `trial`'s place: 0 for itself.
  Eigen::VectorXd LeftOutWeights(int trial) const;
  /// The variance of that prediction, as Variance(); of a repeated position, their mean. Positive.
  double LeftOutVariance(int trial) const;

  /// Variance of the prediction at `position` for a field of variogram |h| (m): 0 at the trials
  /// when ridge is 0.
  double Variance(const Eigen::Ref<const Eigen::VectorXd>& position) const;
  /// Mean over the trials of the variance at each when it is left out; 0 for one position.
  double MeanLeaveOneOutVariance() const { return mean_left_out_variance_; }

 private:
  Eigen::VectorXd GroupWeights(const Eigen::Ref<const Eigen::VectorXd>& position) const;
  Eigen::VectorXd RightSide(const Eigen::Ref<const Eigen::VectorXd>& position) const;

  std::vector<int> group_of_;   // n: index of the distinct position
  Eigen::VectorXd group_size_;  // g
  Eigen::MatrixXd centres_;     // d x g
  Eigen::VectorXd mean_;        // d
  Eigen::MatrixXd basis_;       // d x rank: orthonormal directions of the trend
  double scale_ = 1;            // trend coordinates are divided by it
  Eigen::MatrixXd inverse_;     // of [D T; T^T 0]
  double mean_left_out_variance_ = 0;
};

}  // namespace exemplar::learning
