#pragma once
// The two products that a query spends its time on. They use the processor's wide registers where
// it has them; results agree to rounding.

#include <Eigen/Core>

namespace exemplar::learning {

/// columns * weights.
Eigen::VectorXd WeightedSum(const Eigen::MatrixXd& columns,
                            const Eigen::Ref<const Eigen::VectorXd>& weights);

/// weights * values, for 3 x m weights and m x N values.
Eigen::Matrix3Xd WeightedBlocks(const Eigen::Ref<const Eigen::Matrix3Xd>& weights,
                                const Eigen::MatrixXd& values);

}  // namespace exemplar::learning
