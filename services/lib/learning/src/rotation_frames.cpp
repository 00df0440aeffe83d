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

struct RotationFrames::Candidate {
  bool with_object = false;
  double residual = 0;
  double score = 0;
};

double RotationFrames::Similarity(const FrameSituation& a, const FrameSituation& b,
                                  double residual) const {
  const Eigen::Vector3d from_a = (a.start - a.object) / length_m_;
  const Eigen::Vector3d from_b = (b.start - b.object) / length_m_;
  const double squared = (from_a - from_b).squaredNorm() +
                         0.25 * (a.turn.leftCols<2>() - b.turn.leftCols<2>()).squaredNorm();
  return residual * std::exp(-std::sqrt(squared));
}

PartedCovariance RotationFrames::Parted(const std::vector<int>& chosen,
                                        const Eigen::Ref<const Eigen::VectorXd>& first,
                                        double residual) const {
  PartedCovariance covariance;
  const auto m = static_cast<Eigen::Index>(chosen.size());
  covariance.parts.resize(3 * m, 4);
  covariance.parts.col(0) = std::sqrt(kStartGain) * first;
  covariance.parts.rightCols<3>() =
      std::sqrt(kConstantGain) * Eigen::Matrix3d::Identity().replicate(m, 1);
  if (residual > 0) {
    covariance.similarity.resize(m, m);
    for (Eigen::Index i = 0; i < m; ++i) {
      for (Eigen::Index j = 0; j < m; ++j) {
        covariance.similarity(i, j) = Similarity(
            situations_[static_cast<std::size_t>(chosen[static_cast<std::size_t>(i)])],
            situations_[static_cast<std::size_t>(chosen[static_cast<std::size_t>(j)])], residual);
      }
    }
  }
  return covariance;
}

Eigen::MatrixXd RotationFrames::RotationVectors(const Exemplars& exemplars, bool with_object) {
  const auto n = static_cast<std::size_t>(exemplars.size());
  Eigen::MatrixXd vectors(3 * exemplars.size(), exemplars.frames);
  std::vector<Eigen::Quaterniond> at_frame(n);
  std::vector<Eigen::Quaterniond> means;
  for (int i = 0; i < exemplars.frames; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const ExemplarTrial& trial = exemplars.trials[j];
      at_frame[j] = trial.tool[static_cast<std::size_t>(i)].rotation;
      if (with_object) {
        at_frame[j] = trial.ObjectAt(target_, i).rotation.conjugate() * at_frame[j];
      }
    }
    means.push_back(geometry::MeanRotation(at_frame));
    for (std::size_t j = 0; j < n; ++j) {
      vectors.block<3, 1>(3 * static_cast<Eigen::Index>(j), i) =
          geometry::LogSo3(means.back().conjugate() * at_frame[j]);
    }
  }
  mean_ = FromQuaternions(means);
  return vectors;
}

RotationFrames::RotationFrames(const Exemplars& exemplars, const PathFrames& path)
    : target_(exemplars.target), length_m_(path.length_m()) {
  const auto n = static_cast<std::size_t>(exemplars.size());
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

  std::optional<Candidate> best;
  const std::vector<int> few = EvenChoice(static_cast<int>(n), kMostForChoice);
  for (const bool with_object : {true, false}) {
    if (with_object && !can_turn) continue;
    const Eigen::MatrixXd values = FramesForChoice(RotationVectors(exemplars, with_object), few);
    for (const double residual : {0.0, 1.0, 5.0}) {
      Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(values.rows(), values.cols());
      BlockKriging(Parted(few, values.col(0), residual)).AddLeftOutErrors(values, 1, errors);
      const Candidate candidate{with_object, residual, LeftOutScore(errors)};
      // The first candidates, turned with the object and plainest, win ties.
      if (!best.has_value() || candidate.score < best->score * (1 - 1e-6)) best = candidate;
    }
    if (assumed_) break;
  }
  with_object_ = best->with_object;
  residual_ = best->residual;
  Eigen::MatrixXd vectors = RotationVectors(exemplars, with_object_);
  const Eigen::VectorXd starts = vectors.col(0);
  const std::vector<int> all = EvenChoice(static_cast<int>(n), static_cast<int>(n));
  const Eigen::MatrixXd duals = BlockKriging(Parted(all, starts, residual_)).Duals(vectors);
  vectors.resize(0, 0);
  Eigen::MatrixXd columns(3 * duals.cols(), static_cast<Eigen::Index>(n));
  for (Eigen::Index j = 0; j < columns.cols(); ++j) {
    columns.col(j) = duals.middleRows<3>(3 * j).transpose().reshaped();
  }
  duals_ = residual_ == 0 ? Streams(columns.rowwise().sum()) : Streams(columns);

  // How much of a start's deviation is left at each frame: the start's posterior coefficient.
  of_start_ = kStartGain * (starts.transpose() * duals).transpose();
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
      weights[j] =
          kConstantGain + Similarity(where, situations_[static_cast<std::size_t>(j)], residual_);
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
