#include "rotation_frames.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "rotations.hpp"

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

double RotationFrames::Diagonal(const FrameSituation& a, const FrameSituation& b,
                                double residual) const {
  if (residual == 0) return kConstantGain;
  const Eigen::Vector3d from_a = (a.start - a.object) / length_m_;
  const Eigen::Vector3d from_b = (b.start - b.object) / length_m_;
  const double squared = (from_a - from_b).squaredNorm() +
                         0.25 * (a.turn.leftCols<2>() - b.turn.leftCols<2>()).squaredNorm();
  return kConstantGain + residual * std::exp(-std::sqrt(squared));
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
          Eigen::Matrix3d block = kStartGain * fitted.values.block<3, 1>(row, 0) *
                                  fitted.values.block<3, 1>(column, 0).transpose();
          block.diagonal().array() += Diagonal(situations_[a], situations_[b], residual);
          covariance.block<3, 3>(row, column) = block;
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
  mean_ = FromQuaternions(best->mean);
  const Eigen::MatrixXd duals = best->kriging->Duals(best->values);
  Eigen::MatrixXd columns(3 * duals.cols(), static_cast<Eigen::Index>(n));
  for (Eigen::Index j = 0; j < columns.cols(); ++j) {
    columns.col(j) = duals.middleRows<3>(3 * j).transpose().reshaped();
  }
  duals_ = residual_ == 0 ? Streams(columns.rowwise().sum()) : Streams(columns);

  // How much of a start's deviation is left at each frame: the start's posterior coefficient.
  of_start_ = kStartGain * (best->values.col(0).transpose() * duals).transpose();
  start_share_ = of_start_;
  const double first = start_share_[0];
  if (first > 1e-3) {
    start_share_ /= first;
  } else {
    start_share_ = path.start_share();
  }
  start_share_ = start_share_.cwiseMax(0.0).cwiseMin(1.0);
}

Eigen::MatrixX4d RotationFrames::Predict(const Situation& situation,
                                         const FrameSituation& where) const {
  const Eigen::Quaterniond base_R_frame =
      with_object_ ? situation.base_T_object[static_cast<std::size_t>(target_)].rotation
                   : Eigen::Quaterniond::Identity();
  Eigen::VectorXd weights(duals_.count());
  if (residual_ == 0) {
    weights.setConstant(kConstantGain);
  } else {
    for (Eigen::Index j = 0; j < weights.size(); ++j) {
      weights[j] = Diagonal(where, situations_[static_cast<std::size_t>(j)], residual_);
    }
  }
  Eigen::VectorXd sum = duals_.Sum(weights);
  Eigen::Map<Eigen::MatrixX3d> vectors(sum.data(), mean_.rows(), 3);
  if (situation.base_T_start.has_value() && situation.start_has_orientation) {
    const Eigen::Quaterniond first(mean_(0, 3), mean_(0, 0), mean_(0, 1), mean_(0, 2));
    const Eigen::Vector3d start =
        geometry::LogSo3((base_R_frame * first).conjugate() * situation.base_T_start->rotation);
    vectors += of_start_ * start.transpose();
    const Eigen::RowVector3d missing = start.transpose() - vectors.row(0);
    vectors += start_share_ * missing;
  }
  return Turned(base_R_frame, mean_, vectors);
}

}  // namespace exemplar::learning
