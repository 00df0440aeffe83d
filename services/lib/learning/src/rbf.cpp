#include "exemplar/learning/rbf.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace exemplar::learning {
namespace {

// Positions nearer than this part of their spread are one position.
constexpr double kCoincident = 1e-6;
// Directions with less than this part of the largest extent are not spanned.
constexpr double kFlat = 1e-6;
// Below this, the trend has no position to spare.
constexpr double kNoSpare = 1e-12;
// Beyond, the pivots are sought in columns only: in blocks, ten times as quick.
constexpr Eigen::Index kFewPositions = 100;

}  // namespace

CardinalRbf::CardinalRbf(const Eigen::Ref<const Eigen::MatrixXd>& positions,
                         const RbfOptions& options) {
  const Eigen::Index n = positions.rows();
  const Eigen::Index d = positions.cols();
  assert(n > 0);
  const Eigen::VectorXd overall = positions.colwise().mean().transpose();
  double extent = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    extent = std::max(extent, (positions.row(i).transpose() - overall).norm());
  }
  const double near = std::max(kCoincident * extent, 1e-12);

  centres_.resize(d, n);
  group_size_ = Eigen::VectorXd::Zero(n);
  Eigen::Index groups = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::VectorXd p = positions.row(i).transpose();
    Eigen::Index g = 0;
    while (g < groups && (centres_.col(g) - p).norm() > near) ++g;
    if (g == groups) centres_.col(groups++) = p;
    group_size_[g] += 1;
    group_of_.push_back(static_cast<int>(g));
  }
  centres_.conservativeResize(d, groups);
  group_size_.conservativeResize(groups);
  mean_ = centres_.rowwise().mean();

  const Eigen::MatrixXd centred = centres_.colwise() - mean_;
  basis_.resize(d, 0);
  if (options.trend == Trend::kAffine && groups > 1) {
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(centred, Eigen::ComputeFullU);
    const Eigen::VectorXd& extents = svd.singularValues();
    Eigen::Index rank = 0;
    while (rank < extents.size() && extents[rank] > kFlat * extents[0]) ++rank;
    basis_ = svd.matrixU().leftCols(rank);
  }
  if (extent > 0) scale_ = extent;

  const Eigen::Index trend = 1 + basis_.cols();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(groups + trend, groups + trend);
  for (Eigen::Index i = 0; i < groups; ++i) {
    for (Eigen::Index j = 0; j < groups; ++j) {
      system(i, j) = (centres_.col(i) - centres_.col(j)).norm() / scale_;
    }
  }
  if (groups > 1 && options.ridge > 0) {
    const double mean_distance =
        system.topLeftCorner(groups, groups).sum() / static_cast<double>(groups * (groups - 1));
    // |h| is a variogram: noise lowers the diagonal. A position seen k times is k times as sure.
    system.topLeftCorner(groups, groups).diagonal() -=
        options.ridge * mean_distance * group_size_.cwiseInverse();
  }
  system.col(groups).head(groups).setOnes();
  system.row(groups).head(groups).setOnes();
  const Eigen::MatrixXd slopes = (basis_.transpose() * centred).transpose() / scale_;
  system.block(0, groups + 1, groups, trend - 1) = slopes;
  system.block(groups + 1, 0, trend - 1, groups) = slopes.transpose();
  if (groups <= kFewPositions) {
    inverse_ = Eigen::FullPivLU<Eigen::MatrixXd>(system).inverse();
  } else {
    inverse_ = Eigen::PartialPivLU<Eigen::MatrixXd>(system).inverse();
  }

  if (groups > trend) {
    // The variance at a left-out position is -1 / (M^-1)_kk: Rippa's identity for the power
    // function.
    double sum = 0;
    for (Eigen::Index g = 0; g < groups; ++g) sum += std::max(0.0, -1.0 / inverse_(g, g));
    mean_left_out_variance_ = sum * scale_ / static_cast<double>(groups);
  }
}

Eigen::VectorXd CardinalRbf::RightSide(const Eigen::Ref<const Eigen::VectorXd>& position) const {
  const Eigen::Index groups = centres_.cols();
  Eigen::VectorXd right(groups + 1 + basis_.cols());
  for (Eigen::Index g = 0; g < groups; ++g) {
    right[g] = (position - centres_.col(g)).norm() / scale_;
  }
  right[groups] = 1;
  right.tail(basis_.cols()) = basis_.transpose() * (position - mean_) / scale_;
  return right;
}

Eigen::VectorXd CardinalRbf::GroupWeights(const Eigen::Ref<const Eigen::VectorXd>& position) const {
  return inverse_.topRows(centres_.cols()) * RightSide(position);
}

Eigen::VectorXd CardinalRbf::Weights(const Eigen::Ref<const Eigen::VectorXd>& position) const {
  const Eigen::VectorXd of_group = GroupWeights(position);
  Eigen::VectorXd weights(size());
  for (int j = 0; j < size(); ++j) {
    const int g = group_of_[static_cast<std::size_t>(j)];
    weights[j] = of_group[g] / group_size_[g];
  }
  return weights;
}

CardinalRbf::Coefficients CardinalRbf::Solve(
    const Eigen::Ref<const Eigen::VectorXd>& values) const {
  assert(values.size() == size());
  const Eigen::Index groups = centres_.cols();
  Eigen::VectorXd right = Eigen::VectorXd::Zero(inverse_.rows());
  for (int j = 0; j < size(); ++j) {
    const int g = group_of_[static_cast<std::size_t>(j)];
    right[g] += values[j] / group_size_[g];
  }
  const Eigen::VectorXd solution = inverse_ * right;
  Coefficients coefficients;
  coefficients.lambda = solution.head(groups) / scale_;
  coefficients.c.resize(1 + mean_.size());
  coefficients.c.tail(mean_.size()) = basis_ * solution.tail(basis_.cols()) / scale_;
  coefficients.c[0] = solution[groups] - coefficients.c.tail(mean_.size()).dot(mean_);
  return coefficients;
}

Eigen::MatrixXd CardinalRbf::LeaveOneOut(const Eigen::Ref<const Eigen::MatrixXd>& values) const {
  assert(values.rows() == size());
  const Eigen::Index groups = centres_.cols();
  Eigen::MatrixXd of_group = Eigen::MatrixXd::Zero(groups, values.cols());
  for (int j = 0; j < size(); ++j) {
    const int g = group_of_[static_cast<std::size_t>(j)];
    of_group.row(g) += values.row(j) / group_size_[g];
  }
  const Eigen::MatrixXd lambda = inverse_.topLeftCorner(groups, groups) * of_group;
  Eigen::MatrixXd errors(values.rows(), values.cols());
  for (int j = 0; j < size(); ++j) {
    const int g = group_of_[static_cast<std::size_t>(j)];
    if (group_size_[g] > 1) {
      errors.row(j) = (values.row(j) - of_group.row(g)) * group_size_[g] / (group_size_[g] - 1);
    } else if (groups > 1 && std::abs(inverse_(g, g)) > kNoSpare) {
      errors.row(j) = lambda.row(g) / inverse_(g, g);
    } else {
      // The trend has no position to spare: against the mean of the others.
      errors.row(j) = groups > 1 ? (of_group.row(g) - of_group.colwise().mean()) *
                                       static_cast<double>(groups) / static_cast<double>(groups - 1)
                                 : Eigen::RowVectorXd::Zero(values.cols()).eval();
    }
  }
  return errors;
}

Eigen::VectorXd CardinalRbf::LeftOutWeights(int trial) const {
  const Eigen::Index groups = centres_.cols();
  const int left_out = group_of_[static_cast<std::size_t>(trial)];
  const double own_size = group_size_[left_out];
  const double pivot = inverse_(left_out, left_out);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(size());
  for (int j = 0; j < size(); ++j) {
    const int g = group_of_[static_cast<std::size_t>(j)];
    if (j == trial) continue;
    if (own_size > 1) {
      if (g == left_out) weights[j] = 1 / (own_size - 1);
    } else if (std::abs(pivot) > kNoSpare) {
      weights[j] = -inverse_(left_out, g) / pivot / group_size_[g];
    } else {
      weights[j] = 1 / (static_cast<double>(groups - 1) * group_size_[g]);
    }
  }
  return weights;
}

double CardinalRbf::LeftOutVariance(int trial) const {
  const int g = group_of_[static_cast<std::size_t>(trial)];
  const double mean = mean_left_out_variance_ > 0 ? mean_left_out_variance_ : 1;
  if (group_size_[g] > 1 || !(inverse_(g, g) < -kNoSpare)) return mean;
  return -scale_ / inverse_(g, g);
}

double CardinalRbf::Variance(const Eigen::Ref<const Eigen::VectorXd>& position) const {
  const Eigen::VectorXd right = RightSide(position);
  return std::max(0.0, right.dot(inverse_ * right)) * scale_;
}

}  // namespace exemplar::learning
