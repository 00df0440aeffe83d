#pragma once
// method=paper: PAPER.md section 5 to the letter.

#include <memory>
#include <optional>

#include "exemplar/learning/objectivity.hpp"
#include "exemplar/learning/rbf.hpp"
#include "exemplars.hpp"
#include "prediction.hpp"

namespace exemplar::learning {

/// Joint-wise RBF with affine trend -> FK (absolute); end-effector paths in the shifted object
/// frame (objective); blended by Upsilon from variances. Without joints or robot model the absolute
/// solution is the RBF on paths, which the objective one equals: a plain RBF. Immutable.
class PaperModel final : public Model {
 public:
  /// `tool` may be null; else exemplars.joint_names are its joints (or there are none).
  /// Gives the trials' joints up as it takes them over, where nobody else holds them.
  PaperModel(Exemplars exemplars, std::shared_ptr<const demonstration::ToolKinematics> tool);

  Prediction Predict(const Situation& situation) const override;
  std::vector<LeftOutTrial> LeftOut() const override { return left_out_; }
  /// The absolute solution's tool path alone: Fig. 10's error grows on it. Empty without poses.
  std::vector<geometry::Pose> AbsolutePath(const Situation& situation) const;
  /// False: the trials have no joints and the blend changes nothing.
  bool blends() const { return blends_; }
  bool through_joints() const { return through_joints_; }

 private:
  Eigen::VectorXd Weights(const Situation& situation) const;
  demonstration::ToolKinematics::Path Absolute(const Eigen::VectorXd& weights,
                                               const Eigen::MatrixXd& joints) const;

  int frames_ = 0;
  int joints_count_ = 0;
  int objects_ = 0;
  int target_ = -1;
  bool through_joints_ = false;
  bool blends_ = false;
  std::shared_ptr<const demonstration::ToolKinematics> tool_;
  std::optional<CardinalRbf> rbf_;
  // Of each trial a column: joint by joint, x y z of all frames, hand.
  Streams joints_, base_path_, object_path_, hand_;
  RotationBundle rotation_;
  Eigen::VectorXd upsilon_;            // of the target
  Eigen::MatrixXd objectivity_;        // frames x objects
  Eigen::VectorXd left_out_variance_;  // m^2 a frame
  std::vector<LeftOutTrial> left_out_;
};

}  // namespace exemplar::learning
