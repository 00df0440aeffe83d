#include "paper_model.hpp"

#include <algorithm>
#include <cmath>

#include "exemplar/base/text.hpp"
#include "rotations.hpp"

namespace exemplar::learning {
namespace {

Eigen::MatrixXd TargetPositions(const Exemplars& exemplars) {
  const int width = exemplars.target < 0 ? 0 : 3;
  Eigen::MatrixXd positions(exemplars.size(), width);
  for (int j = 0; j < exemplars.size() && width > 0; ++j) {
    positions.row(j) = exemplars.trials[static_cast<std::size_t>(j)]
                           .situation.base_T_object[static_cast<std::size_t>(exemplars.target)]
                           .translation.transpose();
  }
  return positions;
}

// The paper's motion depends on the object alone. A start further from its first frame than this is
// told.
constexpr double kNearStart_m = 5e-3;
constexpr double kNearStart_rad = 0.02;

void WarnOfStart(double away, double near, const char* unit, std::vector<std::string>& warnings) {
  if (away <= near) return;
  warnings.push_back("method=paper does not use the start: the motion begins " +
                     FormatFixed(away, 3) + " " + unit + " from it");
}

Eigen::MatrixX3d AsPath(const Eigen::VectorXd& stacked) {
  return Eigen::Map<const Eigen::MatrixX3d>(stacked.data(), stacked.size() / 3, 3);
}

}  // namespace

PaperModel::PaperModel(Exemplars exemplars,
                       std::shared_ptr<const demonstration::ToolKinematics> tool)
    : frames_(exemplars.frames),
      joints_count_(exemplars.joints()),
      objects_(exemplars.objects()),
      target_(exemplars.target),
      through_joints_(tool != nullptr && exemplars.joints() > 0 && exemplars.has_tool),
      tool_(std::move(tool)) {
  const int n = exemplars.size();
  rbf_.emplace(TargetPositions(exemplars), RbfOptions{.trend = Trend::kAffine, .ridge = 0});
  const bool has_hand = exemplars.trials[0].hand.size() > 0;
  Eigen::MatrixXd joints(frames_ * joints_count_, n);
  Eigen::MatrixXd hand(has_hand ? frames_ : 0, n);
  for (int j = 0; j < n; ++j) {
    const ExemplarTrial& trial = exemplars.trials[static_cast<std::size_t>(j)];
    joints.col(j) = trial.joints.reshaped();
    if (has_hand) hand.col(j) = trial.hand;
    exemplars.trials.DropJoints(static_cast<std::size_t>(j));
  }
  joints_ = Streams(joints);
  hand_ = Streams(hand);
  objectivity_ = Eigen::MatrixXd::Zero(frames_, objects_);
  if (!exemplars.has_tool) return;

  std::vector<Eigen::MatrixXd> base;
  std::vector<std::vector<Eigen::Quaterniond>> rotations(static_cast<std::size_t>(n));
  Eigen::MatrixXd paths(3 * frames_, n);
  for (int j = 0; j < n; ++j) {
    base.push_back(exemplars.BasePath(j));
    paths.col(j) = base.back().reshaped();
    for (const geometry::Pose& pose : exemplars.trials[static_cast<std::size_t>(j)].tool) {
      rotations[static_cast<std::size_t>(j)].push_back(pose.rotation);
    }
  }
  base_path_ = Streams(paths);
  rotation_ = RotationBundle(rotations);
  upsilon_ = Eigen::VectorXd::Zero(frames_);
  for (int o = 0; o < objects_; ++o) {
    std::vector<Eigen::MatrixXd> shifted;
    for (int j = 0; j < n; ++j) shifted.push_back(exemplars.ShiftedPath(j, o));
    const Objectivity objectivity = ComputeObjectivity(base, shifted, exemplars.FirstContact(o));
    objectivity_.col(o) = objectivity.upsilon;
    if (o != target_) continue;
    upsilon_ = objectivity.upsilon;
    for (int j = 0; j < n; ++j) paths.col(j) = shifted[static_cast<std::size_t>(j)].reshaped();
    object_path_ = Streams(paths);
  }

  blends_ = through_joints_ || rbf_->rank() < 3;

  // Standard error from the closed-form leave-one-out residuals of the path.
  left_out_variance_ = Eigen::VectorXd::Zero(frames_);
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(n);
  for (int i = 0; i < frames_; ++i) {
    Eigen::MatrixXd at_frame(n, 3);
    for (int axis = 0; axis < 3; ++axis) {
      at_frame.col(axis) = paths.row(axis * frames_ + i).transpose();
    }
    const Eigen::VectorXd squared = rbf_->LeaveOneOut(at_frame).rowwise().squaredNorm();
    left_out_variance_[i] = squared.sum() / n;
    largest = largest.cwiseMax(squared);
  }
  for (int j = 0; j < n; ++j) {
    left_out_.push_back({std::sqrt(largest[j]), std::sqrt(rbf_->LeftOutVariance(j))});
  }
}

Eigen::VectorXd PaperModel::Weights(const Situation& situation) const {
  if (target_ < 0) return rbf_->Weights(Eigen::VectorXd());
  return rbf_->Weights(situation.base_T_object[static_cast<std::size_t>(target_)].translation);
}

demonstration::ToolKinematics::Path PaperModel::Absolute(const Eigen::VectorXd& weights,
                                                         const Eigen::MatrixXd& joints) const {
  if (through_joints_) return tool_->ToolPath(joints);
  return {AsPath(base_path_.Sum(weights)), rotation_.Sum(weights)};
}

std::vector<geometry::Pose> PaperModel::AbsolutePath(const Situation& situation) const {
  if (base_path_.rows() == 0) return {};
  const Eigen::VectorXd weights = Weights(situation);
  const auto path = Absolute(weights, joints_.Sum(weights, frames_, joints_count_));
  return ToPoses(path.positions, path.rotations);
}

Prediction PaperModel::Predict(const Situation& situation) const {
  const Eigen::VectorXd weights = Weights(situation);
  Prediction prediction;
  prediction.joints = joints_.Sum(weights, frames_, joints_count_);
  if (hand_.rows() > 0) prediction.hand = hand_.Sum(weights).cwiseMax(0.0).cwiseMin(1.0);
  prediction.objectivity = objectivity_;
  if (base_path_.rows() == 0) {
    if (situation.joint_start.has_value()) {
      const double away_rad =
          (*situation.joint_start - prediction.joints.row(0).transpose()).cwiseAbs().maxCoeff();
      WarnOfStart(away_rad, kNearStart_rad, "rad", prediction.warnings);
    }
    return prediction;
  }

  auto path = Absolute(weights, prediction.joints);
  if (situation.base_T_start.has_value()) {
    const double away_m =
        (situation.base_T_start->translation - path.positions.row(0).transpose()).norm();
    WarnOfStart(away_m, kNearStart_m, "m", prediction.warnings);
  }
  double variance_part = 1;
  if (target_ >= 0) {
    const Eigen::Vector3d base_p_object =
        situation.base_T_object[static_cast<std::size_t>(target_)].translation;
    // Where the positions span space the two solutions of trials without joints are one.
    if (blends_) {
      Eigen::MatrixX3d objective = AsPath(object_path_.Sum(weights));
      objective.rowwise() += base_p_object.transpose();
      path.positions += upsilon_.asDiagonal() * (objective - path.positions);
      path.rotations = Between(path.rotations, rotation_.Sum(weights), upsilon_);
    }
    if (rbf_->MeanLeaveOneOutVariance() > 0) {
      variance_part = rbf_->Variance(base_p_object) / rbf_->MeanLeaveOneOutVariance();
    }
  }
  prediction.tool = ToPoses(path.positions, path.rotations);
  prediction.sigma_m = (left_out_variance_ * variance_part).cwiseSqrt();
  return prediction;
}

}  // namespace exemplar::learning
