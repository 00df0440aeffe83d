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

/// A way to answer. Implementations are immutable, so thread-safe.
class Model {
 public:
  virtual ~Model() = default;
  virtual Prediction Predict(const Situation& situation) const = 0;
};

/// Trials' streams stacked so that a query is one weighted sum: column j is trial j.
class Bundle {
 public:
  Bundle() = default;
  Bundle(int frames, int channels, int trials)
      : channels_(channels), stacked_(Eigen::MatrixXd::Zero(frames * channels, trials)) {}
  /// Rows are frames, columns channels.
  void Set(int trial, const Eigen::Ref<const Eigen::MatrixXd>& stream);
  /// Frame-major: channel k of frame i at i * channels + k.
  Eigen::VectorXd Sum(const Eigen::Ref<const Eigen::VectorXd>& weights) const {
    return WeightedSum(stacked_, weights);
  }
  const Eigen::MatrixXd& stacked() const { return stacked_; }
  int channels() const { return channels_; }
  bool empty() const { return stacked_.size() == 0; }

 private:
  int channels_ = 0;
  Eigen::MatrixXd stacked_;
};

/// Rotations of the trials about their mean at each frame, so that a weighted rotation is a
/// weighted sum of rotation vectors.
class RotationBundle {
 public:
  RotationBundle() = default;
  /// `rotations[trial][frame]`.
  explicit RotationBundle(const std::vector<std::vector<Eigen::Quaterniond>>& rotations);
  /// Frame i of the weighted rotation is mean(i) * Exp(sum's segment 3 i).
  Eigen::VectorXd Sum(const Eigen::Ref<const Eigen::VectorXd>& weights) const {
    return vectors_.Sum(weights);
  }
  Eigen::Quaterniond At(int frame, const Eigen::Ref<const Eigen::VectorXd>& sum) const {
    return mean_[static_cast<std::size_t>(frame)] * geometry::ExpSo3(sum.segment<3>(3 * frame));
  }
  bool empty() const { return mean_.empty(); }

 private:
  std::vector<Eigen::Quaterniond> mean_;
  Bundle vectors_;
};

}  // namespace exemplar::learning
