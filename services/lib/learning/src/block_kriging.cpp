#include "block_kriging.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace exemplar::learning {

BlockKriging::BlockKriging(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& values) {
  const Eigen::Index size = covariance.rows();
  const Eigen::Index n = size / 3;
  const Eigen::MatrixXd total = covariance + Eigen::MatrixXd::Identity(size, size);
  inverse_ = Eigen::LLT<Eigen::MatrixXd>(total).solve(Eigen::MatrixXd::Identity(size, size));
  const Eigen::MatrixXd duals = inverse_ * values;
  errors_.resize(size, values.cols());
  noise_ = Eigen::VectorXd::Zero(values.cols());
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::Matrix3d block = inverse_.block<3, 3>(3 * j, 3 * j);
    errors_.middleRows<3>(3 * j) = block.inverse() * duals.middleRows<3>(3 * j);
    // block is the inverse variance of the left-out error, in units of the noise.
    noise_ += errors_.middleRows<3>(3 * j)
                  .cwiseProduct(duals.middleRows<3>(3 * j))
                  .colwise()
                  .sum()
                  .transpose() /
              static_cast<double>(size);
  }
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
