#include "rotation_frames.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "weighted_sum.hpp"

namespace exemplar::learning {
namespace {

// How far the start's deviation is carried along, and a constant, are left to the data.
constexpr double kStartGain = 1e3;
constexpr double kConstantGain = 1e5;
// Objects turned by less than this between the trials (rad) tell nothing about frames.
constexpr double kNeverTurned = 0.05;

}  // namespace

struct RotationFrames::Fitted {
  bool with_object = false;
  double residual = 0;
  double score = 0;
  std::vector<Eigen::Quaterniond> mean;
  Eigen::MatrixXd values;
  std::optional<BlockKriging> kriging;
};

Eigen::Matrix3d RotationFrames::Covariance(const Eigen::Vector3d& start_a, const FrameSituation& a,
                                           const Eigen::Vector3d& start_b, const FrameSituation& b,
                                           double residual) const {
  Eigen::Matrix3d block = kStartGain * start_a * start_b.transpose();
  block.diagonal().array() += kConstantGain;
  if (residual > 0) {
    const Eigen::Vector3d from_a = (a.start - a.object) / length_m_;
    const Eigen::Vector3d from_b = (b.start - b.object) / length_m_;
    const double squared = (from_a - from_b).squaredNorm() +
                           0.25 * (a.turn.leftCols<2>() - b.turn.leftCols<2>()).squaredNorm();
    block.diagonal().array() += residual * std::exp(-std::sqrt(squared));
  }
  return block;
}

RotationFrames::RotationFrames(const Exemplars& exemplars, const PathFrames& path)
    : target_(exemplars.target), length_m_(path.length_m()) {
  const auto n = static_cast<std::size_t>(exemplars.size());
  const auto frames = static_cast<std::size_t>(exemplars.frames);
  const bool can_turn =
      target_ >= 0 && exemplars.object_has_orientation[static_cast<std::size_t>(target_)];
  double turned = 0;
  for (std::size_t j = 0; j < n; ++j) {
    FrameSituation situation = path.From(exemplars.trials[j].situation);
    situation.start = exemplars.trials[j].tool.front().translation;
    situations_.push_back(situation);
    turned = std::max(turned,
                      Eigen::AngleAxisd(situations_[0].turn.transpose() * situation.turn).angle());
  }
  assumed_ = can_turn && turned < kNeverTurned;

  std::optional<Fitted> best;
  for (const bool with_object : {true, false}) {
    if (with_object && !can_turn) continue;
    Fitted fitted;
    fitted.with_object = with_object;
    fitted.values.resize(3 * static_cast<Eigen::Index>(n), exemplars.frames);
    std::vector<Eigen::Quaterniond> at_frame(n);
    for (std::size_t i = 0; i < frames; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        const ExemplarTrial& trial = exemplars.trials[j];
        at_frame[j] = trial.tool[i].rotation;
        if (with_object) {
          at_frame[j] =
              trial.ObjectAt(target_, static_cast<int>(i)).rotation.conjugate() * at_frame[j];
        }
      }
      fitted.mean.push_back(geometry::MeanRotation(at_frame));
      for (std::size_t j = 0; j < n; ++j) {
        fitted.values.block<3, 1>(3 * static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) =
            geometry::LogSo3(fitted.mean.back().conjugate() * at_frame[j]);
      }
    }
    for (const double residual : {0.0, 1.0, 5.0}) {
      Eigen::MatrixXd covariance(fitted.values.rows(), fitted.values.rows());
      for (std::size_t a = 0; a < n; ++a) {
        for (std::size_t b = 0; b < n; ++b) {
          const auto row = 3 * static_cast<Eigen::Index>(a);
          const auto column = 3 * static_cast<Eigen::Index>(b);
          covariance.block<3, 3>(row, column) =
              Covariance(fitted.values.block<3, 1>(row, 0), situations_[a],
                         fitted.values.block<3, 1>(column, 0), situations_[b], residual);
        }
      }
      fitted.kriging.emplace(covariance, fitted.values);
      fitted.residual = residual;
      fitted.score = LeftOutScore(fitted.kriging->left_out_errors());
      // The first candidates, turned with the object and plainest, win ties.
      if (!best.has_value() || fitted.score < best->score * (1 - 1e-6)) best = fitted;
    }
    if (assumed_) break;
  }
  with_object_ = best->with_object;
  residual_ = best->residual;
  mean_ = std::move(best->mean);
  first_ = best->values.col(0);
  duals_ = best->kriging->Duals(best->values);

  // How much of a start's deviation is left at each frame: the start's posterior coefficient.
  start_share_ = kStartGain * (first_.transpose() * duals_).transpose();
  const double first = start_share_[0];
  if (first > 1e-3) {
    start_share_ /= first;
  } else {
    start_share_ = path.start_share();
  }
  start_share_ = start_share_.cwiseMax(0.0).cwiseMin(1.0);
}

std::vector<Eigen::Quaterniond> RotationFrames::Predict(const Situation& situation,
                                                        const FrameSituation& where) const {
  const Eigen::Quaterniond base_R_frame =
      with_object_ ? situation.base_T_object[static_cast<std::size_t>(target_)].rotation
                   : Eigen::Quaterniond::Identity();
  const bool start_known = situation.base_T_start.has_value() && situation.start_has_orientation;
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  if (start_known) {
    start = geometry::LogSo3((base_R_frame * mean_.front()).conjugate() *
                             situation.base_T_start->rotation);
  }
  const auto n = static_cast<Eigen::Index>(situations_.size());
  Eigen::Matrix3Xd cross(3, 3 * n);
  for (Eigen::Index j = 0; j < n; ++j) {
    cross.middleCols<3>(3 * j) = Covariance(start, where, first_.segment<3>(3 * j),
                                            situations_[static_cast<std::size_t>(j)], residual_);
  }
  const Eigen::Matrix3Xd vectors = WeightedBlocks(cross, duals_);
  const Eigen::Vector3d missing = start - vectors.col(0);
  std::vector<Eigen::Quaterniond> rotations;
  rotations.reserve(mean_.size());
  for (Eigen::Index i = 0; i < vectors.cols(); ++i) {
    Eigen::Vector3d vector = vectors.col(i);
    if (start_known) vector += start_share_[i] * missing;
    rotations.push_back(base_R_frame * mean_[static_cast<std::size_t>(i)] *
                        geometry::ExpSo3(vector));
  }
  return rotations;
}

}  // namespace exemplar::learning
