#include "paper_model.hpp"

#include <algorithm>
#include <cmath>

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

Eigen::MatrixXd AsRows(const Eigen::VectorXd& stacked, int channels) {
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      stacked.data(), stacked.size() / std::max(channels, 1), channels);
}

}  // namespace

PaperModel::PaperModel(const Exemplars& exemplars,
                       std::shared_ptr<const demonstration::ToolKinematics> tool)
    : frames_(exemplars.frames),
      joints_count_(exemplars.joints()),
      objects_(exemplars.objects()),
      target_(exemplars.target),
      through_joints_(tool != nullptr && exemplars.joints() > 0 && exemplars.has_tool),
      tool_(std::move(tool)) {
  const int n = exemplars.size();
  rbf_.emplace(TargetPositions(exemplars), RbfOptions{.trend = Trend::kAffine, .ridge = 0});
  joints_ = Bundle(frames_, joints_count_, n);
  for (int j = 0; j < n; ++j) {
    joints_.Set(j, exemplars.trials[static_cast<std::size_t>(j)].joints);
  }
  if (exemplars.trials[0].hand.size() > 0) {
    hand_ = Bundle(frames_, 1, n);
    for (int j = 0; j < n; ++j) hand_.Set(j, exemplars.trials[static_cast<std::size_t>(j)].hand);
  }
  objectivity_ = Eigen::MatrixXd::Zero(frames_, objects_);
  if (!exemplars.has_tool) return;

  std::vector<Eigen::MatrixXd> base;
  std::vector<std::vector<Eigen::Quaterniond>> rotations(static_cast<std::size_t>(n));
  base_path_ = Bundle(frames_, 3, n);
  for (int j = 0; j < n; ++j) {
    base.push_back(exemplars.BasePath(j));
    base_path_.Set(j, base.back());
    for (const geometry::Pose& pose : exemplars.trials[static_cast<std::size_t>(j)].tool) {
      rotations[static_cast<std::size_t>(j)].push_back(pose.rotation);
    }
  }
  rotation_ = RotationBundle(rotations);
  upsilon_ = Eigen::VectorXd::Zero(frames_);
  for (int o = 0; o < objects_; ++o) {
    std::vector<Eigen::MatrixXd> shifted;
    for (int j = 0; j < n; ++j) shifted.push_back(exemplars.ShiftedPath(j, o));
    const Objectivity objectivity = ComputeObjectivity(base, shifted, exemplars.FirstContact(o));
    objectivity_.col(o) = objectivity.upsilon;
    if (o != target_) continue;
    upsilon_ = objectivity.upsilon;
    object_path_ = Bundle(frames_, 3, n);
    for (int j = 0; j < n; ++j) object_path_.Set(j, shifted[static_cast<std::size_t>(j)]);
  }

  blends_ = through_joints_ || rbf_->rank() < 3;

  // Standard error from the closed-form leave-one-out residuals of the path.
  const Bundle& path = object_path_.empty() ? base_path_ : object_path_;
  const Eigen::MatrixXd residuals = rbf_->LeaveOneOut(path.stacked().transpose());
  left_out_variance_ = Eigen::VectorXd::Zero(frames_);
  for (int i = 0; i < frames_; ++i) {
    left_out_variance_[i] = residuals.middleCols(3 * i, 3).squaredNorm() / n;
  }
}

Eigen::VectorXd PaperModel::Weights(const Situation& situation) const {
  if (target_ < 0) return rbf_->Weights(Eigen::VectorXd());
  return rbf_->Weights(situation.base_T_object[static_cast<std::size_t>(target_)].translation);
}

std::vector<geometry::Pose> PaperModel::Absolute(const Eigen::VectorXd& weights,
                                                 const Eigen::MatrixXd& joints) const {
  std::vector<geometry::Pose> path(static_cast<std::size_t>(frames_));
  if (through_joints_) {
    for (int i = 0; i < frames_; ++i) {
      path[static_cast<std::size_t>(i)] = tool_->ToolPose(joints.row(i).transpose());
    }
    return path;
  }
  const Eigen::VectorXd positions = base_path_.Sum(weights);
  const Eigen::VectorXd turns = rotation_.Sum(weights);
  for (int i = 0; i < frames_; ++i) {
    path[static_cast<std::size_t>(i)] = {positions.segment<3>(3 * i), rotation_.At(i, turns)};
  }
  return path;
}

std::vector<geometry::Pose> PaperModel::AbsolutePath(const Situation& situation) const {
  if (base_path_.empty()) return {};
  const Eigen::VectorXd weights = Weights(situation);
  return Absolute(weights, AsRows(joints_.Sum(weights), joints_count_));
}

Prediction PaperModel::Predict(const Situation& situation) const {
  const Eigen::VectorXd weights = Weights(situation);
  Prediction prediction;
  prediction.joints =
      joints_count_ > 0 ? AsRows(joints_.Sum(weights), joints_count_) : Eigen::MatrixXd(frames_, 0);
  if (!hand_.empty()) prediction.hand = hand_.Sum(weights).cwiseMax(0.0).cwiseMin(1.0);
  prediction.objectivity = objectivity_;
  if (base_path_.empty()) return prediction;

  prediction.tool = Absolute(weights, prediction.joints);
  double variance_part = 1;
  if (target_ >= 0) {
    const Eigen::Vector3d base_p_object =
        situation.base_T_object[static_cast<std::size_t>(target_)].translation;
    // Where the positions span space the two solutions of trials without joints are one.
    if (blends_) {
      const Eigen::VectorXd relative = object_path_.Sum(weights);
      const Eigen::VectorXd turns = rotation_.Sum(weights);
      for (int i = 0; i < frames_; ++i) {
        geometry::Pose& pose = prediction.tool[static_cast<std::size_t>(i)];
        const geometry::Pose objective{base_p_object + relative.segment<3>(3 * i),
                                       rotation_.At(i, turns)};
        pose.translation += upsilon_[i] * (objective.translation - pose.translation);
        pose.rotation = pose.rotation.slerp(upsilon_[i], objective.rotation);
      }
    }
    if (rbf_->MeanLeaveOneOutVariance() > 0) {
      variance_part = rbf_->Variance(base_p_object) / rbf_->MeanLeaveOneOutVariance();
    }
  }
  prediction.sigma_m = (left_out_variance_ * variance_part).cwiseSqrt();
  return prediction;
}

}  // namespace exemplar::learning
