#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "exemplar/geometry/pose.hpp"
#include "exemplars.hpp"
#include "weighted_sum.hpp"

namespace exemplar::learning {

/// What a model says for one situation, on the common time base.
struct Prediction {
  Eigen::MatrixXd joints;            ///< frames x joints
  std::vector<geometry::Pose> tool;  ///< base_T_tool, frames or empty
  Eigen::VectorXd hand;              ///< frames or empty
  Eigen::MatrixXd objectivity;       ///< frames x objects
  Eigen::VectorXd sigma_m;           ///< frames or empty
  /// Where the tool meets the object, as Exemplars::contacts; empty: their mean contact points.
  std::vector<Eigen::Vector3d> contact_points;
  std::vector<std::string> warnings;
};

/// How well the others predict a trial, in closed form.
struct LeftOutTrial {
  double distance_m = 0;  ///< the largest between its path and theirs at the same frame
  double spread = 1;      ///< how large errors are at its place, beside other places
};

/// A way to answer. Implementations are immutable, so thread-safe.
class Model {
 public:
  virtual ~Model() = default;
  virtual Prediction Predict(const Situation& situation) const = 0;
  /// One a trial. Empty without tool poses.
  virtual std::vector<LeftOutTrial> LeftOut() const = 0;
};

/// Rotations of the trials about their mean at each frame, so that a weighted rotation is a
/// weighted sum of rotation vectors.
class RotationBundle {
 public:
  RotationBundle() = default;
  /// `rotations[trial][frame]`.
  explicit RotationBundle(const std::vector<std::vector<Eigen::Quaterniond>>& rotations);
  /// One a frame, x y z w.
  Eigen::MatrixX4d Sum(const Eigen::Ref<const Eigen::VectorXd>& weights) const;

 private:
  Eigen::MatrixX4d mean_;
  Streams vectors_;  // x y z of all frames a column, a column a trial
};

}  // namespace exemplar::learning
