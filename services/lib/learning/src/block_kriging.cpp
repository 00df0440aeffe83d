#include "block_kriging.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace exemplar::learning {
namespace {

// Up to so many trials the inverse is kept whole: a query multiplies by it at once.
constexpr Eigen::Index kFewTrials = 30;
// Frames whose left-out errors are made at a time, so that nothing as large as the trials is kept
// beside them.
constexpr Eigen::Index kChunk = 64;
constexpr Eigen::Index kFramesForChoice = 150;

Eigen::MatrixXd InverseOf(const Eigen::MatrixXd& positive) {
  return Eigen::LLT<Eigen::MatrixXd>(positive).solve(
      Eigen::MatrixXd::Identity(positive.rows(), positive.rows()));
}

Eigen::MatrixXd Dense(const PartedCovariance& covariance) {
  Eigen::MatrixXd dense = covariance.parts * covariance.parts.transpose();
  for (Eigen::Index a = 0; a < covariance.similarity.rows(); ++a) {
    for (Eigen::Index b = 0; b < covariance.similarity.cols(); ++b) {
      auto block = dense.block<3, 3>(3 * a, 3 * b);
      if (covariance.turns.empty()) {
        block.diagonal().array() += covariance.similarity(a, b);
      } else {
        block += covariance.similarity(a, b) * covariance.turns[static_cast<std::size_t>(a)] *
                 covariance.turns[static_cast<std::size_t>(b)].transpose();
      }
    }
  }
  return dense;
}

void Turn(const std::vector<Eigen::Matrix3d>& turns, bool back, Eigen::MatrixXd& values) {
  for (std::size_t j = 0; j < turns.size(); ++j) {
    Eigen::Matrix3d turn = turns[j];
    if (back) turn.transposeInPlace();
    const auto row = 3 * static_cast<Eigen::Index>(j);
    for (Eigen::Index c = 0; c < values.cols(); ++c) {
      const Eigen::Vector3d turned = turn * values.block<3, 1>(row, c);
      values.block<3, 1>(row, c) = turned;
    }
  }
}

// T (inverse x I) T^T values.
Eigen::MatrixXd ApplyToAxes(const Eigen::MatrixXd& inverse,
                            const std::vector<Eigen::Matrix3d>& turns, Eigen::MatrixXd values) {
  if (inverse.size() == 0) return values;
  using Strided = Eigen::Map<Eigen::MatrixXd, 0, Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>>;
  Turn(turns, true, values);
  const Eigen::Index n = inverse.rows();
  for (int axis = 0; axis < 3; ++axis) {
    Strided of_axis(values.data() + axis, n, values.cols(),
                    Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>(values.rows(), 3));
    const Eigen::MatrixXd gathered = of_axis;
    of_axis = inverse * gathered;
  }
  Turn(turns, false, values);
  return values;
}

}  // namespace

BlockKriging::BlockKriging(const PartedCovariance& covariance)
    : trials_(covariance.parts.rows() / 3) {
  if (trials_ <= kFewTrials) {
    Eigen::MatrixXd total = Dense(covariance);
    total.diagonal().array() += 1;
    inverse_ = InverseOf(total);
    return;
  }
  if (covariance.similarity.size() > 0) {
    Eigen::MatrixXd noisy = covariance.similarity;
    noisy.diagonal().array() += 1;
    similarity_inverse_ = InverseOf(noisy);
    turns_ = covariance.turns;
  }
  const Eigen::MatrixXd solved = ApplyToAxes(similarity_inverse_, turns_, covariance.parts);
  Eigen::MatrixXd inner = covariance.parts.transpose() * solved;
  inner.diagonal().array() += 1;
  const Eigen::LLT<Eigen::MatrixXd> root(inner);
  correction_ = root.matrixL().solve(solved.transpose()).transpose();
}

Eigen::MatrixXd BlockKriging::Duals(const Eigen::Ref<const Eigen::MatrixXd>& values) const {
  if (inverse_.size() > 0) return inverse_ * values;
  Eigen::MatrixXd duals = ApplyToAxes(similarity_inverse_, turns_, values);
  const Eigen::MatrixXd shared = correction_.transpose() * values;
  duals.noalias() -= correction_ * shared;
  return duals;
}

Eigen::Matrix3d BlockKriging::DiagonalBlock(Eigen::Index trial) const {
  if (inverse_.size() > 0) return inverse_.block<3, 3>(3 * trial, 3 * trial);
  const double own = similarity_inverse_.size() > 0 ? similarity_inverse_(trial, trial) : 1.0;
  const Eigen::MatrixXd rows = correction_.middleRows<3>(3 * trial);
  return own * Eigen::Matrix3d::Identity() - rows * rows.transpose();
}

double BlockKriging::LeftOutSpread(Eigen::Index trial) const {
  return std::sqrt(DiagonalBlock(trial).inverse().trace() / 3);
}

Eigen::VectorXd BlockKriging::AddLeftOutErrors(const Eigen::MatrixXd& values, double share,
                                               Eigen::MatrixXd& errors) const {
  std::vector<Eigen::Matrix3d> variances;  // of the left-out errors, in units of the noise
  for (Eigen::Index j = 0; j < trials_; ++j) variances.push_back(DiagonalBlock(j).inverse());
  Eigen::VectorXd noise = Eigen::VectorXd::Zero(values.cols());
  for (Eigen::Index first = 0; first < values.cols(); first += kChunk) {
    const Eigen::Index count = std::min(kChunk, values.cols() - first);
    const Eigen::MatrixXd duals = Duals(values.middleCols(first, count));
    for (Eigen::Index c = 0; c < count; ++c) {
      for (Eigen::Index j = 0; j < trials_; ++j) {
        const Eigen::Vector3d dual = duals.block<3, 1>(3 * j, c);
        const Eigen::Vector3d error = variances[static_cast<std::size_t>(j)] * dual;
        errors.block<3, 1>(3 * j, first + c) += share * error;
        noise[first + c] += error.dot(dual) / static_cast<double>(3 * trials_);
      }
    }
  }
  return noise;
}

std::vector<int> EvenChoice(int n, int most) {
  const int count = std::min(n, most);
  std::vector<int> chosen;
  for (int k = 0; k < count; ++k) {
    chosen.push_back(static_cast<int>(static_cast<long long>(k) * n / count));
  }
  return chosen;
}

Eigen::MatrixXd FramesForChoice(const Eigen::MatrixXd& values, const std::vector<int>& chosen) {
  const Eigen::Index columns = std::min(values.cols(), kFramesForChoice);
  Eigen::MatrixXd few(3 * static_cast<Eigen::Index>(chosen.size()), columns);
  for (Eigen::Index c = 0; c < columns; ++c) {
    const Eigen::Index frame = columns > 1 ? c * (values.cols() - 1) / (columns - 1) : 0;
    for (std::size_t k = 0; k < chosen.size(); ++k) {
      few.block<3, 1>(3 * static_cast<Eigen::Index>(k), c) =
          values.block<3, 1>(3 * chosen[k], frame);
    }
  }
  return few;
}

double LeftOutScore(const Eigen::MatrixXd& errors) {
  const Eigen::Index n = errors.rows() / 3;
  double score = 0;
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::VectorXd distance = errors.middleRows<3>(3 * j).colwise().norm().transpose();
    score += distance.mean() + 0.5 * distance.maxCoeff() + distance[distance.size() - 1];
  }
  return score / static_cast<double>(n);
}

}  // namespace exemplar::learning
